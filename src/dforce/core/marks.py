"""Marks of parameters that hold text: words, or the name of a file, which a guest of a server may not give."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

import pydantic
from pydantic_core import PydanticUndefined


@dataclass(frozen=True)
class FileName:
    """A parameter that names a file on the computer that reads the case: a guest of a server may not set it.

    With `through_named` the file is read only by :func:`dforce.core.files.named`, which refuses guests itself. The name
    may then stay in a case that already has the values of the file.
    """

    through_named: bool = False

    def __call__(self, schema: dict[str, Any]) -> None:
        """Mark the text as a path in the JSON schema."""
        schema["format"] = "path"


@dataclass(frozen=True)
class Words:
    """A parameter that is text, or holds some, and names no file by itself."""

    def __call__(self, schema: dict[str, Any]) -> None:
        """Leave the JSON schema as it is."""


def file_name(
    default: object = PydanticUndefined, *, description: str, through_named: bool = False, **limits: Any
) -> Any:
    """Declare a parameter that names a file, or several; each text of a case is this, words, or a choice."""
    return pydantic.Field(default, description=description, json_schema_extra=FileName(through_named), **limits)


def words(default: object = PydanticUndefined, *, description: str, **limits: Any) -> Any:
    """Declare a parameter that is text, or holds some, and names no file by itself."""
    return pydantic.Field(default, description=description, json_schema_extra=Words(), **limits)


def may_be_read(field: pydantic.fields.FieldInfo) -> bool:
    """Return whether a field's value may be the name of a file that is read: unmarked text may be."""
    mark = field.json_schema_extra
    if isinstance(mark, FileName):
        return not mark.through_named
    return not isinstance(mark, Words) and holds_text(field.annotation)


def holds_text(annotation: object) -> bool:
    """Return whether a value of this kind may hold text of any wording, which a choice does not."""
    if get_origin(annotation) is Literal or (
        isinstance(annotation, type) and issubclass(annotation, pydantic.BaseModel)
    ):
        return False
    return annotation in (str, bytes, object, Any, Path, dict, list) or any(map(holds_text, get_args(annotation)))
