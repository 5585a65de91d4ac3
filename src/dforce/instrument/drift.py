"""A lever whose Q or free amplitude was seen to change on its way to the sample."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Self

import pydantic

from dforce.core.columns import read_columns
from dforce.core.errors import ParameterError, shorten
from dforce.core.files import named
from dforce.core.marks import file_name
from dforce.core.parameters import Numbers, Parameters, param
from dforce.instrument.modes import amplitude, quality


class Drift(Parameters):
    """Measured changes of Q, of the free amplitude, or of both, near the sample and before contact."""

    title_of: ClassVar[str] = "cantilever.drift"
    example: ClassVar[Mapping[str, Any]] = {"zc": ["0 um", "5 um"], "Q": [180, 200]}

    file: str | None = file_name(
        None,
        max_length=500,
        description="a CSV file with the columns height, Q and A0 (Q or A0 may be missing), instead of numbers",
    )
    zc: Numbers = param(unit="m", symbol="z_c", doc="average distances, rising; beyond the last, values are constant")
    Q: Numbers = quality((), doc="quality factor at each distance; default: the Q of the lever")
    A0: Numbers = amplitude(
        (), symbol="A_0", doc="free amplitude at each distance; default: from Q at a constant driving force"
    )

    @pydantic.model_validator(mode="before")
    @classmethod
    def _numbers_of_a_file(cls, data: object) -> Any:
        if not isinstance(data, Mapping) or not isinstance(data.get("file"), str):
            return data
        for name in ("zc", "Q", "A0"):
            if data.get(name):
                raise ParameterError(f"cantilever.drift has both file and {name}; write only one of them")
        key = "cantilever.drift.file"
        found = read_columns(named(data["file"], key), key, {"height": "m", "Q": "1", "A0": "m"})
        if "height" not in found:
            raise ParameterError(f"{key} = '{shorten(data['file'])}' has no column 'height'")
        order = sorted(range(len(found["height"])), key=found["height"].__getitem__)  # a ramp may start far away
        rest = {name: value for name, value in data.items() if name != "file"}  # the case keeps the values of the file
        sorted_columns = {name: [column[i] for i in order] for name, column in found.items()}
        return rest | {"zc": sorted_columns.pop("height")} | sorted_columns

    @pydantic.model_validator(mode="after")
    def _a_table(self) -> Self:
        if len(self.zc) < 2 or any(b <= a for a, b in zip(self.zc, self.zc[1:], strict=False)):
            raise ParameterError("cantilever.drift.zc needs two distances or more, in rising order")
        if not self.Q and not self.A0:
            raise ParameterError("cantilever.drift has neither Q nor A0; write one of them, or both")
        for name in ("Q", "A0"):
            count = len(getattr(self, name))
            if count and count != len(self.zc):
                raise ParameterError(
                    f"cantilever.drift.{name} has {count} values for {len(self.zc)} distances; write one for each"
                )
        return self
