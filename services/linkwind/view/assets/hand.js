// Takes the picture by the hand: the wheel zooms, a drag moves, a double click goes back.

const CLOSEST = 200, FARTHEST = 0.05; // zoom

export function makeHand(canvas, { look, camera, draw }) {
  canvas.classList.add("orbit");

  function move(dx, dy) {
    look.pan[0] -= dx / camera.scale;
    look.pan[1] += dy / camera.scale;
  }

  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    const factor = Math.exp(-0.0015 * event.deltaY), zoom = Math.min(CLOSEST, Math.max(FARTHEST, look.zoom * factor));
    const box = canvas.getBoundingClientRect(), share = 1 - look.zoom / zoom; // what is under the mouse stays there
    move(-share * (event.clientX - box.left - camera.w / 2), -share * (event.clientY - box.top - camera.h / 2));
    look.zoom = zoom;
    draw();
  }, { passive: false });
  canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
  canvas.addEventListener("pointermove", (event) => {
    if (!event.buttons) return;
    move(event.movementX, event.movementY);
    draw();
  });
  canvas.addEventListener("dblclick", () => { look.zoom = 1; look.pan.fill(0); draw(); });
}
