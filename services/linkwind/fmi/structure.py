"""What depends on what in a mechanism: the bodies of one tree, the joints on the way to a body."""

from __future__ import annotations

from linkwind.fmi.coordinates import Piece, joint_names, pieces
from linkwind.fmi.elements import Elements
from linkwind.fmi.variables import Dependence, Kind
from linkwind.mechanism import Mechanism

Dependences = tuple[Dependence, ...]


class Structure:
    """Dependences of the quantities of a mechanism on its knowns.

    Lists may name a known that happens to have no influence for a special geometry, never leave one out.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        parents = mechanism.tables.parent.tolist()
        self._bodies, self._joints = mechanism.bodies, joint_names(mechanism)
        self._stated = [is_stated(joint) for joint in mechanism.joints]
        self._pieces = pieces(mechanism)
        self._path = [_path(i, parents) for i in range(len(parents))]
        self.elements = Elements(mechanism)
        self._root = roots = _groups(mechanism, self.elements, [path[0] for path in self._path])
        self._accelerations = {root: self._acceleration(self._tree(root)) for root in set(roots)}
        self._inertias = {root: self._inertia(self._tree(root)) for root in set(roots)}

    def _tree(self, root: int) -> list[int]:
        return [k for k, own in enumerate(self._root) if own == root]

    def position(self, i: int) -> Dependences:
        """Of the centre of mass of body i."""
        places = (
            Dependence(piece.called("q"), "dependent" if piece.turns else _kind(piece))
            for piece in self._on(i)
        )
        return (*places, *self.moved(self._path[i]))

    def orientation(self, i: int) -> Dependences:
        """Of body i."""
        turns = (Dependence(piece.called("q")) for piece in self._on(i) if piece.turns)
        return (*turns, *self.moved(self._path[i]))

    def linear(self, i: int) -> Dependences:
        """Of the velocity of body i: lever arms do not depend on where the root is."""
        arms = [Dependence(p.called("q")) for p in self._on(i) if p.turns or not p.of_root]
        speeds = [Dependence(p.called("v"), "dependent" if p.turns else _kind(p)) for p in self._on(i)]
        return (*arms, *speeds, *self.moved(self._path[i]))

    def angular(self, i: int) -> Dependences:
        """Of the angular velocity of body i: each joint turns about an axis that those before have turned."""
        turns = [piece for piece in self._on(i) if piece.turns]
        turned = [p for p in turns if p is not turns[-1] or p.quaternion]
        rates = [Dependence(p.called("v"), "dependent" if p.quaternion else _kind(p)) for p in turns]
        return (*(Dependence(p.called("q")) for p in turned), *rates, *self.moved(self._path[i]))

    def acceleration(self, i: int) -> Dependences:
        """Of accelerations and reactions of body i: on everything in its tree."""
        return self._accelerations[self._root[i]]

    def _acceleration(self, tree: list[int]) -> Dependences:
        knowns = []
        for k in tree:
            knowns += [piece.called(what) for piece in self._pieces[k] for what in ("q", "v")]
            knowns += [f"{self._bodies[k]}.{what}" for what in ("F", "T", "A")]
        knowns += self.elements.input_names(tree)
        if self.elements.in_time(tree):
            knowns.append("time")
        return tuple(map(Dependence, knowns))

    def moved(self, bodies: list[int]) -> Dependences:
        """Time, for what depends on the joints of some bodies, if a motion prescribes one of them."""
        return (Dependence("time"),) if self.elements.moved & set(bodies) else ()

    def kinetic_energy(self) -> Dependences:
        """Of all bodies."""
        every = [piece for joint in self._pieces for piece in joint]
        return (
            *(Dependence(piece.called("q")) for piece in every if piece.turns or not piece.of_root),
            *(Dependence(piece.called("v")) for piece in every),
            *self.moved(list(range(len(self._bodies)))),
        )

    def potential_energy(self) -> Dependences:
        """Of all bodies and springs."""
        places = (Dependence(piece.called("q")) for joint in self._pieces for piece in joint)
        return (*places, *self.moved(list(range(len(self._bodies)))))

    def geometry(self, i: int) -> Dependences:
        """Parameters that place the joints on the way to body i."""
        stated = [k for k in self._path[i] if self._stated[k]]
        return self._parameters(stated, "parent_point", "child_point")

    def inertia(self, i: int) -> Dependences:
        """Parameters that accelerations in the tree of body i depend on."""
        return self._inertias[self._root[i]]

    def _inertia(self, tree: list[int]) -> Dependences:
        stated = [k for k in tree if self._stated[k]]
        bodies = tuple(Dependence(f"{self._bodies[k]}.{what}") for k in tree for what in ("mass", "inertia"))
        points = self._parameters(stated, "parent_point", "child_point")
        springs = self._springs(stated, "stiffness", "damping", "rest")
        springs += tuple(map(Dependence, self.elements.parameter_names(tree)))
        return (Dependence("gravity"), *bodies, *points, *springs)

    def stored(self) -> Dependences:
        """Parameters of the potential energy."""
        stated = [k for k, yes in enumerate(self._stated) if yes]
        masses = tuple(Dependence(f"{body}.mass") for body in self._bodies)
        points = self._parameters(stated, "parent_point", "child_point")
        springs = self._springs(stated, "stiffness", "rest")
        every = list(range(len(self._bodies)))
        springs += tuple(map(Dependence, self.elements.parameter_names(every, stored=True)))
        return (Dependence("gravity"), *masses, *points, *springs)

    def moving(self) -> Dependences:
        """Parameters of the kinetic energy."""
        stated = [k for k, yes in enumerate(self._stated) if yes]
        bodies = tuple(Dependence(f"{body}.{what}") for body in self._bodies for what in ("mass", "inertia"))
        return (*bodies, *self._parameters(stated, "parent_point", "child_point"))

    def _on(self, i: int) -> list[Piece]:
        return [piece for k in self._path[i] for piece in self._pieces[k]]

    def _parameters(self, joints: list[int], *whats: str) -> Dependences:
        return tuple(Dependence(f"{self._joints[k]}.{what}") for k in joints for what in whats)

    def _springs(self, joints: list[int], *whats: str) -> Dependences:
        return tuple(
            Dependence(piece.called(what)) for k in joints for piece in self._pieces[k] for what in whats
        )


def _groups(mechanism: Mechanism, elements: Elements, roots: list[int]) -> list[int]:
    """Return for each body the same number as for those that it acts on, also by loops and elements."""
    group = list(roots)
    for first, second in [*mechanism.tables.closure_body.tolist(), *elements.pairs]:
        if first >= 0 and second >= 0:
            group = [group[second] if own == group[first] else own for own in group]
    return group


def is_stated(joint: str) -> bool:
    """Return whether the scenario states a joint of this name; automatic ones hold a character it refuses."""
    return "-" not in joint


def _path(i: int, parents: list[int]) -> list[int]:
    """Return the joints from the root to body i."""
    way = [i]
    while parents[way[-1]] >= 0:
        way.append(parents[way[-1]])
    return way[::-1]


def _kind(piece: Piece) -> Kind:
    return "constant" if piece.of_root else "dependent"
