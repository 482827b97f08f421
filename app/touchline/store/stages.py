"""Stage plans as YAML files, one plan a file, named as the plan is."""

from pathlib import Path

from touchline.core.common_sentences import use_one_of
from touchline.core.errors import NotFound
from touchline.core.statements import say
from touchline.installation import shipped
from touchline.store.files import read_yaml
from touchline.vision.stage_pipeline import StageConfig


def load_plans() -> dict[str, StageConfig]:
    """Load every plan that comes with Touchline, by name, in order."""
    plans = [load_plan(path) for path in sorted((shipped("configs") / "stages").glob("*.yaml"))]
    if not plans:
        raise NotFound("The detection plans of Touchline are not installed.", "Install Touchline again.",
                       reason="no-stages")
    return {plan.name: plan for plan in plans}


def load_plan(path: Path) -> StageConfig:
    """Load the plan of one file."""
    return read_yaml(path, StageConfig.from_json, f"The plan {path.name}", "no-stages")


def named_plan(name: str) -> StageConfig:
    """Return a plan that comes with Touchline; NotFound."""
    plans = load_plans()
    if name not in plans:
        raise NotFound(say("plan.unknown", "There is no detection plan called {name!r}.", name=name[:40]),
                       use_one_of(plans), reason="unknown-stages")
    return plans[name]
