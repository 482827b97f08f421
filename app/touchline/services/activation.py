"""The one way in which a version becomes its camera's active one: nothing that stands against it is passed over."""

from collections.abc import Sequence

from touchline.core.errors import Conflict
from touchline.core.records import Calibration
from touchline.core.statements import say
from touchline.evaluate.claims import Claim, problems
from touchline.services.claims import all_claims
from touchline.services.container import IsAbandoned, Services


async def activate(services: Services, id: str, by: str, etag: str | None, despite: Sequence[str],
                   is_abandoned: IsAbandoned) -> Calibration:
    """Activate a version; Conflict "problems-found" where claims stand against it that `despite` does not name.

    What was true a moment ago is asked again: its camera may have moved since. etag: as the store takes it. What it
    was activated in spite of is kept in the history, as far as it stood against it.
    """
    store = services.store.calibrations
    calibration = await services.run_in_thread(store.get, id)
    if calibration.active:  # nothing changes
        return calibration
    claims = await all_claims(services, calibration, is_abandoned)
    against = [claim.code for claim in problems(claims)]
    if left := problems(claims, despite):
        raise _refusal(calibration, left, against)
    activated = await services.run_in_thread(store.activate, id, by, etag, against)
    if activated.camera is not None:
        services.live.refresh(activated.camera)
    for part in services.running_parts:
        part.wake()
    return activated


def _refusal(calibration: Calibration, left: Sequence[Claim], against: Sequence[str]) -> Conflict:
    return Conflict(
        say("activation.problems", "Version {version} was not activated: {problems}.", version=calibration.version,
            problems=[claim.title for claim in left]),
        say("activation.problems.fix", "Mend these problems, or activate it despite them."),
        reason="problems-found", claims=[claim.to_json() for claim in left], despite=against)
