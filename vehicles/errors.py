"""What may be wrong with a vehicle, in one line each."""

from collections.abc import Sequence


class VehicleError(ValueError):
    """A vehicle's data cannot be used; the text names file, field, value and what is allowed."""


class UnknownModel(VehicleError):
    """There is no such vehicle; `models` are those that exist."""

    def __init__(self, model: str, models: Sequence[str]) -> None:
        super().__init__(
            f"unknown vehicle model {model!r}; there are: {', '.join(models)}, or the path of a folder of your own"
        )
        self.model = model
        self.models = tuple(models)
