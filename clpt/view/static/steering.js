// Pointer, touch and keys. Every key stands in KEYS, from which the help is made.

const FLY = { KeyW: [0, 0, 1], KeyS: [0, 0, -1], KeyA: [-1, 0, 0], KeyD: [1, 0, 0], KeyQ: [0, -1, 0], KeyE: [0, 1, 0] };
const TURN = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
const FLY_RATE = 0.6; // shares of the distance a second
const TURN_RATE = 0.25; // heights of the picture a second
const CLICK = 4; // pixels that a click may move

export const GESTURES = [
  ["drag", "orbit about the pivot"],
  ["Shift drag, two fingers", "pan"],
  ["Alt drag, right drag", "look around"],
  ["wheel, pinch", "nearer, farther"],
  ["Shift wheel", "field of view"],
  ["click", "hold the pixel in the inspector; again: let it go"],
  ["double click", "the pivot is what was clicked"],
  ["Ctrl click", "focus on what was clicked"],
];

export class Steering extends EventTarget {
  // keys: what keys are heard of, the window or an element that may have the focus.
  constructor(picture, connection, actions, keys) {
    super();
    Object.assign(this, { picture, connection, actions });
    this.tool = null; // what the next click does: pivot, focus, hide, region
    this.pointers = new Map();
    this.pressed = new Set();
    const { canvas } = picture;
    canvas.addEventListener("pointerdown", (event) => this.down(event));
    canvas.addEventListener("pointermove", (event) => this.move(event));
    for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, (event) => this.up(event));
    canvas.addEventListener("pointerleave", () => this.emit("hover", null));
    canvas.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("dblclick", (event) => this.pick("pick", event));
    keys.addEventListener("keydown", (event) => this.key(event));
    keys.addEventListener("keyup", ({ code }) => this.pressed.delete(code));
    keys.addEventListener("blur", () => this.pressed.clear());
  }

  emit(name, detail) {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }

  choose(tool) {
    this.tool = this.tool === tool ? null : tool;
    this.picture.canvas.classList.toggle("aims", this.tool !== null);
    this.emit("tool", this.tool);
  }

  pick(name, event) {
    const at = this.picture.pixel(event);
    if (at) this.connection.send(name, at);
    return at;
  }

  down(event) {
    this.picture.canvas.focus({ preventScroll: true });
    this.picture.canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, event);
    this.start = event;
    this.dragged = false;
    const box = this.picture.canvas.getBoundingClientRect();
    const share = (event.clientX - box.left) / box.width;
    this.wiping = this.picture.wipe !== null && this.picture.kept && Math.abs(share - this.picture.wipe) * box.width < 12;
    this.corner = this.tool === "region" ? this.picture.pixel(event) : null;
  }

  move(event) {
    const before = this.pointers.get(event.pointerId);
    if (!before) {
      this.emit("hover", this.picture.pixel(event));
      return;
    }
    if (Math.hypot(event.clientX - this.start.clientX, event.clientY - this.start.clientY) > CLICK) this.dragged = true;
    if (!this.dragged) return;
    const height = this.picture.canvas.clientHeight;
    const dx = (event.clientX - before.clientX) / height;
    const dy = (event.clientY - before.clientY) / height;
    this.pointers.set(event.pointerId, event);
    if (this.wiping) {
      const box = this.picture.canvas.getBoundingClientRect();
      this.picture.wipe = Math.min(1, Math.max(0, (event.clientX - box.left) / box.width));
      this.picture.paint();
    } else if (this.corner) {
      this.picture.region = rectangle(this.corner, this.clamped(event));
      this.picture.paintOverlay();
    } else if (this.pointers.size === 2) {
      this.pinch(event, before, height);
    } else if (this.pointers.size === 1) {
      const pans = event.shiftKey || event.buttons === 4;
      const looks = event.altKey || event.buttons === 2;
      this.connection.add(pans ? "pan" : looks ? "look" : "orbit", { dx, dy });
    }
  }

  pinch(event, before, height) {
    const other = [...this.pointers.values()].find(({ pointerId }) => pointerId !== event.pointerId);
    const gap = (one) => Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY) || 1;
    this.connection.add("dolly", { by: Math.log(gap(event) / gap(before)) });
    this.connection.add("pan", {
      dx: (event.clientX - before.clientX) / height / 2,
      dy: (event.clientY - before.clientY) / height / 2,
    });
  }

  up(event) {
    if (!this.pointers.delete(event.pointerId) || this.pointers.size) return;
    if (this.corner) {
      const region = this.picture.region;
      if (region) this.connection.send("region", { x: region[0], y: region[1], width: region[2], height: region[3] });
      this.corner = null;
      this.choose(null);
    } else if (!this.dragged && event.type === "pointerup" && event.button === 0) {
      this.click(event);
    }
  }

  click(event) {
    const at = this.picture.pixel(event);
    if (!at) return;
    if (this.tool === "pivot") this.connection.send("pick", at);
    else if (this.tool === "focus" || event.ctrlKey || event.metaKey) this.connection.send("focus", at);
    else if (this.tool === "hide") this.emit("hide", at);
    else this.emit("hold", at);
    if (this.tool) this.choose(null);
  }

  clamped(event) {
    const box = this.picture.canvas.getBoundingClientRect();
    const within = (value, most) => Math.min(most - 1, Math.max(0, Math.floor(value * most)));
    return {
      x: within((event.clientX - box.left) / box.width, this.picture.film[0]),
      y: within((event.clientY - box.top) / box.height, this.picture.film[1]),
    };
  }

  wheel(event) {
    event.preventDefault();
    const step = -event.deltaY * (event.deltaMode === 1 ? 16 : 1) / 500;
    if (event.shiftKey) this.emit("zoom", step || -event.deltaX / 500);
    else this.connection.add("dolly", { by: Math.max(-1, Math.min(1, step)) });
  }

  key(event) {
    const typing = event.target.closest?.("input:not([type=range]):not([type=checkbox]), select, textarea, dialog");
    if (typing || event.ctrlKey || event.metaKey || event.altKey) return;
    const sliding = event.target.closest?.("input, button, summary, [role=tab]");
    if ((FLY[event.code] && !event.shiftKey) || (TURN[event.code] && !sliding)) {
      event.preventDefault();
      event.stopPropagation();
      if (!this.pressed.size) this.last = performance.now();
      this.pressed.add(event.code);
      this.glide();
      return;
    }
    if (event.key === " " && sliding) return;
    const action = this.actions.find(({ keys }) => keys.includes(event.key));
    if (action) {
      event.preventDefault();
      action.run();
    }
  }

  // Move as long as keys are held.
  glide() {
    if (this.gliding) return;
    const step = (now) => {
      this.gliding = undefined;
      if (!this.pressed.size) return;
      const seconds = Math.min(0.1, (now - this.last) / 1000);
      this.last = now;
      const fly = [0, 0, 0];
      const turn = [0, 0];
      for (const code of this.pressed) {
        FLY[code]?.forEach((value, i) => { fly[i] += value * FLY_RATE * seconds; });
        TURN[code]?.forEach((value, i) => { turn[i] += value * TURN_RATE * seconds; });
      }
      if (fly.some(Boolean)) this.connection.add("fly", { right: fly[0], up: fly[1], forward: fly[2] });
      if (turn.some(Boolean)) this.connection.add("orbit", { dx: turn[0], dy: turn[1] });
      this.gliding = requestAnimationFrame(step);
    };
    this.gliding = requestAnimationFrame(step);
  }
}

function rectangle(a, b) {
  const [x, y] = [Math.min(a.x, b.x), Math.min(a.y, b.y)];
  return [x, y, Math.abs(a.x - b.x) + 1, Math.abs(a.y - b.y) + 1];
}
