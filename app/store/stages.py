"""Plans of stages that are kept as YAML files, one plan a file, named as the plan is."""

from pathlib import Path

from app.core.errors import BadInput, NotFound
from app.core.strict_yaml import MAX_BYTES, plain_from_yaml
from app.vision.stage_pipeline import StageConfig

_APP = Path(__file__).resolve().parent.parent
# An installed wheel carries configs/ inside the package; a checkout has it beside.
_PLACES = (_APP / "_configs" / "stages", _APP.parent / "configs" / "stages")


def load_plans() -> dict[str, StageConfig]:
    """Every plan that comes with Touchline, by name, in order."""
    for place in _PLACES:
        if place.is_dir():
            plans = [load_plan(path) for path in sorted(place.glob("*.yaml"))]
            return {plan.name: plan for plan in plans}
    raise NotFound("The plans of stages that come with Touchline are not installed.", "Install Touchline again.",
                   reason="no-stages")


def load_plan(path: Path) -> StageConfig:
    """The plan in one file."""
    try:
        with path.open("rb") as file:
            raw = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise NotFound(f"The plan {path.name} cannot be read: {error.strerror}.",
                       "Check the file and who may read it.", reason="no-stages") from None
    try:
        return StageConfig.from_json(plain_from_yaml(raw, f"The file {path.name}"))
    except BadInput as error:
        raise BadInput(f"{path.name}: {error.what}", error.fix, reason=error.reason) from None


def named_plan(name: str) -> StageConfig:
    """A plan that comes with Touchline."""
    plans = load_plans()
    if name not in plans:
        raise NotFound(f"There is no plan of stages called {name[:40]!r}.", f"Use one of: {', '.join(plans)}.",
                       reason="unknown-stages")
    return plans[name]
