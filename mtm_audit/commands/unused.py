"""Options that change nothing for the recording and the key at hand, told and not ignored in silence."""

from mtm_audit.model.recording import Kind

# By what they are for; all of them are named as a person gives them.
OF_FILMS = frozenset({"--tracker", "--reference", "--frame-rate", "--camera"})
OF_LOGS = frozenset({"--topic", "--body", "--unit", "--time-unit", "--up", "--heading-axis", "--arrival-times"})
OF_ROLLING_KEYS = frozenset({"--at"})


def unused_options(given: frozenset[str], kind: Kind, schedule: str) -> tuple[str, ...]:
    """A sentence for each kind of option that was given in vain."""
    found = []
    for_films, for_logs = sorted(given & OF_FILMS), sorted(given & OF_LOGS)
    if kind == "motion capture" and for_films:
        found.append(f"{_were(for_films)} not used: the recording is motion capture or a log, and no film")
    if kind == "video" and for_logs:
        found.append(f"{_were(for_logs)} not used: the recording is a film, and no log")
    if schedule == "fixed" and given & OF_ROLLING_KEYS:
        found.append("--at was not used: the key's schedule is fixed, so that it does not matter when it was recorded")
    return tuple(found)


def _were(names: list[str]) -> str:
    return f"{names[0]} was" if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]} were"
