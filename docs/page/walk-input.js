// Keyboard, mouse and touch of the walk.

const KEYS = new Set(["KeyW", "KeyA", "KeyS", "KeyD", "KeyQ", "KeyE", "KeyF", "KeyR", "Space",
  "ArrowUp", "ArrowDown", "ArrowLeft", "ArrowRight"]);

/** Listens on the canvas; the function that it returns tells what is wanted now. */
export function steer(canvas, walker) {
  const down = new Set();
  const touches = new Map();
  const look = (x, y, factor) => {
    walker.yaw -= x * factor;
    walker.pitch = Math.max(-1.5, Math.min(1.5, walker.pitch - y * factor));
  };

  canvas.addEventListener("keydown", (event) => {
    if (!KEYS.has(event.code) || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    if (event.code === "KeyF" && !event.repeat) walker.fly = !walker.fly;
    if (event.code === "KeyR") walker.reset();
    down.add(event.code);
  });
  canvas.addEventListener("keyup", (event) => down.delete(event.code));
  canvas.addEventListener("blur", () => down.clear());

  canvas.addEventListener("pointerdown", (event) => {
    canvas.focus({ preventScroll: true });
    const { left, width } = canvas.getBoundingClientRect();
    const moves = event.pointerType !== "mouse" && event.clientX - left < width / 2;
    touches.set(event.pointerId, { moves, startX: event.clientX, startY: event.clientY, x: event.clientX, y: event.clientY });
    canvas.setPointerCapture(event.pointerId);
    // Where the mouse cannot be locked, a drag looks.
    if (event.pointerType === "mouse") canvas.requestPointerLock?.()?.catch?.(() => {});
  });
  canvas.addEventListener("pointermove", (event) => {
    if (document.pointerLockElement === canvas) return look(event.movementX, event.movementY, 0.0022);
    const touch = touches.get(event.pointerId);
    if (!touch) return;
    if (!touch.moves) look(event.clientX - touch.x, event.clientY - touch.y, 0.005);
    Object.assign(touch, { x: event.clientX, y: event.clientY });
  });
  for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, (event) => touches.delete(event.pointerId));

  const key = (...codes) => (codes.some((code) => down.has(code)) ? 1 : 0);
  return () => {
    let right = key("KeyD", "ArrowRight") - key("KeyA", "ArrowLeft");
    let forward = key("KeyW", "ArrowUp") - key("KeyS", "ArrowDown");
    for (const { moves, startX, startY, x, y } of touches.values()) {
      if (!moves) continue;
      right += (x - startX) / 50;
      forward -= (y - startY) / 50;
    }
    const length = Math.max(1, Math.hypot(right, forward));
    return {
      wish: { right: right / length, forward: forward / length },
      jump: down.has("Space"),
      turn: key("KeyQ") - key("KeyE"),
    };
  };
}
