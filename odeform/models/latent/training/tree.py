"""Nested dictionaries and lists of tensors and plain values, split into what JSON and what safetensors can hold."""

from typing import Any

import torch

__all__ = ["flatten", "unflatten"]

MARK = "tensor:"


def flatten(tree: Any, tensors: dict[str, torch.Tensor], name: str) -> Any:
    """The tree for JSON, with names in place of its tensors, which are put into `tensors`. Names begin with `name`."""
    if isinstance(tree, torch.Tensor):
        tensors[name] = tree
        return MARK + name
    if isinstance(tree, dict):
        return {key: flatten(value, tensors, f"{name}.{key}") for key, value in tree.items()}
    if isinstance(tree, list | tuple):
        return [flatten(value, tensors, f"{name}.{index}") for index, value in enumerate(tree)]
    return tree


def unflatten(tree: Any, tensors: dict[str, torch.Tensor]) -> Any:
    """The inverse of `flatten`; tuples come back as lists. `KeyError` where a tensor is missing."""
    if isinstance(tree, str) and tree.startswith(MARK):
        return tensors[tree.removeprefix(MARK)]
    if isinstance(tree, dict):
        return {key: unflatten(value, tensors) for key, value in tree.items()}
    if isinstance(tree, list):
        return [unflatten(value, tensors) for value in tree]
    return tree
