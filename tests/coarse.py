"""Built-in scenarios that take long: settings with which some dozens of their steps take a second or two."""

COARSE = {
    # 80 × 72 × 64 cells, in which the wings stay for 300 steps
    "fruit_fly": ("aero.flow.cells=24", "aero.flow.window=[9e-3, 8.1e-3, 7.2e-3]", "aero.flow.frames=6"),
}
