"""A box of fluid for OpenFOAM's icoFoam: a uniform stream with vortices in it, nx x ny cells.

Lattice units throughout, so that the case is the lattice's own: cells of 1, a stream of ``SPEED`` cells in
a step of 1 or more. The pressure is solved by multigrid to the tolerances of the tutorials, in two PISO
corrections.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np

SPEED, VORTEX, LENGTH, VISCOSITY = 0.08, 0.02, 64, 1e-3
HOMES = ("/usr/share/openfoam", "/usr/lib/openfoam/openfoam1912")  # of Debian's package, and of its makers'

HEADER = "FoamFile {{ version 2.0; format ascii; class {kind}; object {name}; }}\n"
CONTROL = """
application icoFoam; startFrom startTime; startTime 0; stopAt endTime; endTime {end}; deltaT {step};
writeControl timeStep; writeInterval 1000000; timePrecision 8; runTimeModifiable false;
"""
SCHEMES = """
ddtSchemes { default Euler; } gradSchemes { default Gauss linear; } divSchemes { default Gauss linear; }
laplacianSchemes { default Gauss linear orthogonal; } interpolationSchemes { default linear; }
snGradSchemes { default orthogonal; }
"""
SOLUTION = """
solvers {
    p { solver GAMG; smoother GaussSeidel; tolerance 1e-6; relTol 0.05; }
    pFinal { $p; relTol 0; }
    U { solver smoothSolver; smoother symGaussSeidel; tolerance 1e-5; relTol 0; }
}
PISO { nCorrectors 2; nNonOrthogonalCorrectors 0; }
"""
MESH = """
convertToMeters 1;
vertices ((0 0 0) ({nx} 0 0) ({nx} {ny} 0) (0 {ny} 0) (0 0 1) ({nx} 0 1) ({nx} {ny} 1) (0 {ny} 1));
blocks (hex (0 1 2 3 4 5 6 7) ({nx} {ny} 1) simpleGrading (1 1 1));
edges ();
boundary (
    inlet {{ type patch; faces ((0 4 7 3)); }} outlet {{ type patch; faces ((1 2 6 5)); }}
    sides {{ type patch; faces ((0 1 5 4) (3 7 6 2)); }}
    planes {{ type empty; faces ((0 3 2 1) (4 5 6 7)); }}
);
"""
VELOCITY = """
dimensions [0 1 -1 0 0 0 0];
internalField nonuniform List<vector> {count} ({values});
boundaryField {{
    inlet {{ type fixedValue; value uniform ({speed} 0 0); }} outlet {{ type zeroGradient; }}
    sides {{ type slip; }} planes {{ type empty; }}
}}
"""
PRESSURE = """
dimensions [0 2 -2 0 0 0 0];
internalField uniform 0;
boundaryField {
    inlet { type zeroGradient; } outlet { type fixedValue; value uniform 0; }
    sides { type zeroGradient; } planes { type empty; }
}
"""


def missing() -> str | None:
    """Return why the case cannot run here, or None."""
    for command in ("blockMesh", "icoFoam"):
        if not shutil.which(command):
            return f"needs OpenFOAM, {command} is not on the path"
    return None


def write(folder: Path, nx: int, ny: int, steps: int, step: int) -> None:
    """Write the case into a folder: so many steps, each as long as ``step`` of the lattice's."""
    y, x = np.mgrid[:ny, :nx] * 2 * np.pi / LENGTH
    u = SPEED + VORTEX * np.cos(x) * np.sin(y)
    v = -VORTEX * np.sin(x) * np.cos(y)
    values = " ".join(f"({a:.6f} {b:.6f} 0)" for a, b in zip(u.ravel(), v.ravel(), strict=True))
    files = {
        "system/controlDict": CONTROL.format(end=steps * step, step=step),
        "system/fvSchemes": SCHEMES,
        "system/fvSolution": SOLUTION,
        "system/blockMeshDict": MESH.format(nx=nx, ny=ny),
        "constant/transportProperties": f"nu [0 2 -1 0 0 0 0] {VISCOSITY};",
        "0/U": VELOCITY.format(count=nx * ny, values=values, speed=SPEED),
        "0/p": PRESSURE,
    }
    kinds = {"0/U": "volVectorField", "0/p": "volScalarField"}
    for name, text in files.items():
        file = folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(HEADER.format(kind=kinds.get(name, "dictionary"), name=file.name) + text)


def run(folder: Path) -> list[float]:
    """Mesh and run a case; return the processor time of each step but the first [s]."""
    home = next((home for home in HOMES if Path(home).is_dir()), HOMES[0])
    environment = {"WM_PROJECT_DIR": home} | os.environ
    output = ""
    for command in ("blockMesh", "icoFoam"):
        done = subprocess.run(
            [command, "-case", str(folder)], env=environment, capture_output=True, text=True, check=False
        )
        output = done.stdout
        if done.returncode:
            raise RuntimeError(f"{command}: {(done.stdout + done.stderr)[-2000:]}")
    at = [float(t) for t in re.findall(r"^ExecutionTime = (\S+) s", output, flags=re.MULTILINE)]
    return np.diff(at).tolist()
