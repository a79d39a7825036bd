// The picture on plain 2D canvases: frames of any size are drawn to the film's; beside it a kept one.

export class Picture extends EventTarget {
  // room: the element that it fits into.
  constructor(canvas, overlay, connection, room) {
    super();
    this.canvas = canvas;
    this.overlay = overlay;
    this.connection = connection;
    this.room = room;
    this.film = [1, 1];
    this.latest = 0;
    this.actual = false; // one pixel of the film for one of the screen
    this.wipe = null; // a share of the width: to its left is what was kept
    this.differs = false;
    this.region = null;
    this.marks = [];
    this.now = document.createElement("canvas"); // the newest frame, in the film's size
    this.kept = null;
    connection.addEventListener("frame", ({ detail }) => this.show(detail));
    new ResizeObserver(() => this.fit()).observe(room);
  }

  async show({ header, file }) {
    let bitmap;
    try {
      bitmap = await createImageBitmap(file, { colorSpaceConversion: "none" });
    } catch {
      bitmap = null; // a broken frame is as good as shown
    }
    if (bitmap && header.frame > this.latest) {
      this.latest = header.frame;
      this.header = header;
      this.place(bitmap, header);
      this.paint();
      this.dispatchEvent(new CustomEvent("shown", { detail: header }));
    }
    bitmap?.close();
    this.connection.send("shown", { frame: header.frame });
  }

  place(bitmap, { film, crop }) {
    if (film[0] !== this.now.width || film[1] !== this.now.height) {
      this.film = film;
      for (const one of [this.now, this.canvas]) [one.width, one.height] = film;
      this.kept = null;
      this.fit();
    }
    const context = this.now.getContext("2d", { alpha: false });
    const [x, y, width, height] = crop ?? [0, 0, ...film];
    context.imageSmoothingEnabled = bitmap.width !== width;
    context.imageSmoothingQuality = "medium";
    context.drawImage(bitmap, x, y, width, height);
  }

  // Keep the picture as it is, to compare with.
  keep() {
    this.kept = document.createElement("canvas");
    [this.kept.width, this.kept.height] = this.film;
    this.kept.getContext("2d", { alpha: false }).drawImage(this.now, 0, 0);
  }

  paint() {
    const context = this.canvas.getContext("2d", { alpha: false });
    const [width, height] = this.film;
    context.globalCompositeOperation = "source-over";
    context.drawImage(this.now, 0, 0);
    if (this.kept && this.differs) {
      context.globalCompositeOperation = "difference";
      context.drawImage(this.kept, 0, 0);
      context.globalCompositeOperation = "lighter"; // eight times as bright
      for (let i = 0; i < 3; i++) context.drawImage(this.canvas, 0, 0);
      context.globalCompositeOperation = "source-over";
    } else if (this.kept && this.wipe !== null) {
      const x = Math.round(this.wipe * width);
      if (x > 0) context.drawImage(this.kept, 0, 0, x, height, 0, 0, x, height);
    }
    this.paintOverlay();
  }

  // Lines over the picture, as fine as the screen.
  paintOverlay() {
    const { overlay } = this;
    const ratio = window.devicePixelRatio || 1;
    const box = this.canvas.getBoundingClientRect();
    [overlay.width, overlay.height] = [Math.round(box.width * ratio), Math.round(box.height * ratio)];
    const context = overlay.getContext("2d");
    const scale = overlay.width / this.film[0];
    const line = (draw) => {
      for (const [colour, width] of [["#0009", 3 * ratio], ["#fffd", ratio]]) {
        context.strokeStyle = colour;
        context.lineWidth = width;
        context.beginPath();
        draw();
        context.stroke();
      }
    };
    if (this.kept && this.wipe !== null && !this.differs) {
      const x = this.wipe * overlay.width;
      line(() => { context.moveTo(x, 0); context.lineTo(x, overlay.height); });
    }
    if (this.region) {
      const [x, y, width, height] = this.region.map((value) => value * scale);
      line(() => context.rect(x, y, width, height));
    }
    for (const { x, y, kind } of this.marks) {
      const [cx, cy, r] = [(x + 0.5) * scale, (y + 0.5) * scale, 6 * ratio];
      line(() => {
        if (kind === "pixel") context.rect(cx - r, cy - r, 2 * r, 2 * r);
        else { context.moveTo(cx + r, cy); context.arc(cx, cy, r, 0, 7); }
      });
    }
  }

  fit() {
    const box = this.room.getBoundingClientRect();
    const fitting = Math.min(box.width / this.film[0], box.height / this.film[1]);
    const scale = this.actual ? 1 / (window.devicePixelRatio || 1) : fitting;
    for (const one of [this.canvas, this.overlay]) {
      one.style.width = `${Math.max(1, Math.round(this.film[0] * scale))}px`;
      one.style.height = `${Math.max(1, Math.round(this.film[1] * scale))}px`;
    }
    this.canvas.classList.toggle("sharp", scale * (window.devicePixelRatio || 1) >= 1);
    this.paintOverlay();
  }

  // The pixel of the film under a pointer, or null.
  pixel({ clientX, clientY }) {
    const box = this.canvas.getBoundingClientRect();
    const x = Math.floor(((clientX - box.left) / box.width) * this.film[0]);
    const y = Math.floor(((clientY - box.top) / box.height) * this.film[1]);
    return x >= 0 && y >= 0 && x < this.film[0] && y < this.film[1] ? { x, y } : null;
  }
}
