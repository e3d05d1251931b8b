"""From a plan to the scheme that robot and auditor will share."""

from dataclasses import replace

from mtm_audit.planning.plan import Plan
from mtm_audit.planning.table import members_of
from mtm_onboard.protocol.scheme import Scheme


def scheme_of_plan(plan: Plan, like: Scheme) -> Scheme:
    """The plan's scheme with all that no plan decides (rate, band, axes, noise, framing) taken from `like`.

    Its name says what is new in it, such as `lab-split-M16-T300` after a key's `lab`.
    Raises MtmError when `like` lacks a channel of the plan, or when the result cannot be played.
    """
    chosen = [(name, count) for pooled, count in plan.allocation.items() for name in members_of(pooled)]
    return replace(
        like,
        name=f"{like.name}-{plan.strategy}-M{plan.alphabet_size}-T{plan.message_ticks}",
        alphabet_size=plan.alphabet_size,
        message_ticks=plan.message_ticks,
        channels=tuple(replace(like.channel(name), symbols=count) for name, count in chosen),
        combine="same" if plan.strategy == "same" else "split",
    )
