"""Modules that only a part of the package needs."""

from __future__ import annotations

import importlib.util


def need(extra: str, *modules: str) -> None:
    """Raises an error that names the extra where one of its modules is missing, before anything has begun."""
    for module in modules:
        if importlib.util.find_spec(module) is None:
            remedy = f"pip install './python[{extra}]' in a checkout of hapticd"
            message = f"this needs {module}, of the extra `{extra}`: {remedy}"
            raise ModuleNotFoundError(message, name=module)
