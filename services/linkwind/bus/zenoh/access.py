"""Who may do what on a secure bus, as zenoh's access control: nothing, but for what is listed here.

The subject is the name in the certificate at the other end of a link. Whoever others come to, the dynamics
or a router, lets in only what each role says by its own right; whoever goes there trusts that end.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from linkwind.bus.base import PREFIX
from linkwind.credentials import DYNAMICS, OBSERVER, OPERATOR, ROUTER

RUN = f"{PREFIX}/*"
EVERYTHING = f"{PREFIX}/**"
MESSAGES = (
    "put",
    "delete",
    "declare_subscriber",
    "query",
    "reply",
    "declare_queryable",
    "liveliness_token",
    "declare_liveliness_subscriber",
    "liveliness_query",
)
SAID = ("wrench", "checkpoint", "observe/*")
PRESENCE = ("declare_liveliness_subscriber", "liveliness_query")


def of_hub(providers: Iterable[str], trusted: str) -> dict[str, Any]:
    """Return the rules of an end that others come to.

    Args:
        providers: names of those that may take part.
        trusted: whose every word counts: the router for the dynamics, the dynamics for a router.
    """
    rules = [
        _rule("hear", MESSAGES, ["egress"], EVERYTHING),
        _rule("trust", MESSAGES, ["ingress"], EVERYTHING),
        _rule("watch", PRESENCE, ["ingress"], f"{RUN}/alive/*"),
        _rule("follow", ["declare_subscriber"], ["ingress"], f"{RUN}/motion", f"{RUN}/fault"),
        _rule("read", ["declare_subscriber"], ["ingress"], EVERYTHING),
        _rule("listen", ["query"], ["ingress"], f"{RUN}/scenario", f"{RUN}/playback"),
        _rule("command", ["query"], ["ingress"], f"{RUN}/control/order"),
        # Whoever has a certificate that means nothing here can learn just that.
        _rule("ask why", ["query"], ["ingress"], f"{RUN}/refusal"),
        _rule("say why", ["reply", "declare_queryable"], ["egress"], f"{RUN}/refusal"),
    ]
    policies = [
        _policy([trusted], ["hear", "trust"]),
        _policy([OBSERVER], ["hear", "read", "watch", "listen"]),
        _policy([OPERATOR], ["hear", "command"]),
        _policy(["anybody"], ["ask why", "say why"]),
    ]
    for name in providers:
        rules += [
            _rule(f"{name} says", ["put"], ["ingress"], *(f"{RUN}/{key}/{name}" for key in SAID)),
            _rule(f"{name} asks", ["query"], ["ingress"], f"{RUN}/control/{name}"),
            _rule(f"{name} is there", ["liveliness_token"], ["ingress"], f"{RUN}/alive/{name}"),
        ]
        own = [f"{name} says", f"{name} asks", f"{name} is there"]
        policies.append(_policy([name], ["hear", "follow", "watch", *own]))
    subjects = {subject for policy in policies for subject in policy["subjects"]}
    return _access(rules, policies, subjects)


def of_guest() -> dict[str, Any]:
    """Return the rules of an end that goes to the dynamics or to a router: it trusts those two."""
    rules = [_rule("all", MESSAGES, ["egress", "ingress"], EVERYTHING)]
    return _access(rules, [_policy([DYNAMICS, ROUTER], ["all"])], {DYNAMICS, ROUTER})


def _rule(name: str, messages: Iterable[str], flows: list[str], *keys: str) -> dict[str, Any]:
    return {"id": name, "permission": "allow", "messages": list(messages), "flows": flows, "key_exprs": keys}


def _policy(subjects: list[str], rules: list[str]) -> dict[str, Any]:
    return {"subjects": subjects, "rules": rules}


def _access(
    rules: list[dict[str, Any]], policies: list[dict[str, Any]], subjects: set[str]
) -> dict[str, Any]:
    named = [{"id": name, "cert_common_names": [name]} for name in sorted(subjects - {"anybody"})]
    everybody = [{"id": "anybody"}] if "anybody" in subjects else []
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": named + everybody,
        "policies": policies,
    }
