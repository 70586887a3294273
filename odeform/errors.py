"""The error for faulty input."""

__all__ = ["InputError"]


class InputError(ValueError):
    """The input is at fault: a file, a name, a number or a shape.

    Its message is one line that says what was expected and what was given. Commands print it and exit with code 2.

    Examples:
        >>> import odeform
        >>> try:
        ...     odeform.load("kick").solve(parameters={"mass": -1.0})
        ... except odeform.InputError as error:
        ...     print(error)
        mass: expected a positive number in kg, got -1
    """
