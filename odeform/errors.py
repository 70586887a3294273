"""The errors that commands turn into exit codes, and words of messages."""

__all__ = ["FailedCheck", "InputError", "counted", "one_line"]

WORD, LINE = 300, 1000  # characters


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

    def __init__(self, message: object = "") -> None:
        """The message is printed as it is given, up to `one_line`."""
        super().__init__(one_line(message))


def one_line(text: object) -> str:
    """A text in one line without control characters; the middle of a very long word, and of the whole, is left out."""
    words = [_shortened("".join(filter(str.isprintable, word)), WORD) for word in str(text).split()]
    return _shortened(" ".join(words), LINE)


def counted(count: int, name: str) -> str:
    """Writes how many there are of something, whose plural ends in s: `1 line`, `2,000 lines`."""
    return f"{count:,} {name}{'' if count == 1 else 's'}"


def _shortened(text: str, most: int) -> str:
    return text if len(text) <= most else f"{text[: most - 60]}…{text[-59:]}"


class FailedCheck(Exception):
    """The work was done and its result printed, but a measured figure misses its bound. Commands exit with code 1."""
