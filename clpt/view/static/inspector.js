// What is under the cursor: values, samples, first hit, and the spectrum with its error.

import { h, many, short, within } from "./dom.js";
import { spectrumPlot } from "./plot.js";

const SAMPLE = Object.assign(document.createElement("canvas"), { width: 1, height: 1 });
const REST_MS = 140; // the cursor rests before a spectrum is asked for

export class Inspector {
  // edit: opens the panel of a material, where there are panels.
  constructor(pane, picture, connection, steering, edit = null) {
    Object.assign(this, { pane, picture, connection, edit });
    this.at = this.held = this.compared = null;
    this.found = {};
    steering.addEventListener("hover", ({ detail }) => this.hover(detail));
    steering.addEventListener("hold", ({ detail }) => this.hold(detail));
    for (const type of ["value", "hit", "spectrum"]) {
      connection.addEventListener(type, ({ detail }) => this.take(type, detail));
    }
    picture.addEventListener("shown", () => this.again());
    this.draw();
  }

  get visible() {
    return this.pane.offsetParent !== null;
  }

  hover(at) {
    if (this.held || !this.visible || !at) return;
    if (this.at && at.x === this.at.x && at.y === this.at.y) return;
    this.at = at;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.ask(), REST_MS);
  }

  hold(at) {
    if (this.held && Math.hypot(at.x - this.held.x, at.y - this.held.y) * this.picture.canvas.clientWidth / this.picture.film[0] < 8) {
      this.held = null;
    } else {
      this.held = this.at = at;
      this.ask();
    }
    this.picture.marks = this.held ? [{ ...this.held, kind: "pixel" }] : [];
    this.picture.paintOverlay();
    this.draw();
  }

  ask() {
    if (!this.at) return;
    this.found = { value: this.found.value, spectrum: this.found.spectrum };
    this.connection.send("inspect", this.at);
  }

  // The picture has changed: what was told of the pixel is not of this scene any more.
  again() {
    if (!this.at || !this.visible) return;
    const samples = this.picture.header.samples;
    if (samples < (this.seen ?? 0) || this.picture.header.rest) this.ask();
    else if (this.picture.header.divider === 1) this.connection.send("value", this.at);
    this.seen = samples;
  }

  take(type, detail) {
    if (!this.at || detail.x !== this.at.x || detail.y !== this.at.y) return;
    if (type === "value") this.found = { ...this.found, value: detail };
    this.found[type] = detail;
    this.draw();
  }

  draw() {
    const { value, hit, spectrum } = this.found;
    if (!this.at || !value) {
      this.pane.replaceChildren(h("p", { class: "empty" }, "Point at the picture. The values of the pixel, what it shows, and its spectrum appear here. A click holds the pixel."));
      return;
    }
    const same = spectrum && spectrum.x === this.at.x && spectrum.y === this.at.y;
    const parts = [h("p", { class: "at" }, h("b", {}, `${this.at.x}, ${this.at.y}`), this.held ? " held" : "",
      this.swatch(value.rgb))];
    const list = h("dl");
    const add = (name, text, tip) => list.append(h("dt", { title: tip }, name), h("dd", {}, text));
    if (value.rgb) {
      add("rgb", value.rgb.map((v) => short(v, 4)).join("  "), "linear, in the film's output space");
      add("samples", String(value.samples), "of this pixel so far");
    }
    if (same && spectrum.rgb_mean) {
      add("exact", spectrum.rgb_mean.map((v, i) => within(v, spectrum.rgb_error[i])).join("\n"),
        `this pixel with ${many(spectrum.samples)}samples of its own, ± one standard error`);
    }
    if (hit) {
      if (hit.shape === null) add("shows", "nothing");
      else {
        add("shows", hit.object?.name ?? `shape ${hit.shape}`, `shape ${hit.shape}, primitive ${hit.primitive}`);
        const { made_of: material, material: panel = null } = hit.object ?? {};
        const name = material?.replaceAll("_", " ");
        if (name && this.edit && panel !== null) add("material", h("button", { class: "link", title: "its panel", onclick: () => this.edit(panel) }, name));
        else if (name) add("material", name);
        add("depth", `${short(hit.depth)} m`);
        add("position", hit.position.map((v) => short(v)).join("  "));
        add("normal", hit.shading_normal.map((v) => short(v, 3)).join("  "));
        add("uv", hit.uv.map((v) => short(v, 3)).join("  "));
        add("albedo", hit.albedo.map((v) => short(v, 3)).join("  "));
      }
    }
    if (same) {
      parts.push(h("figure", {}, spectrumPlot(spectrum, this.compared),
        h("figcaption", {}, `radiance, W m⁻² sr⁻¹ nm⁻¹; bars: one standard error of ${spectrum.samples} samples${spectrum.note ? `, ${spectrum.note}` : ""}`,
          h("button", { class: "quiet", onclick: () => { this.compared = this.compared ? null : spectrum; this.draw(); } },
            this.compared ? "forget the other" : "compare"))));
    }
    parts.push(list);
    this.pane.replaceChildren(...parts);
  }

  swatch(rgb) {
    if (!rgb) return "";
    const context = SAMPLE.getContext("2d", { alpha: false, willReadFrequently: true });
    context.drawImage(this.picture.now, -this.at.x, -this.at.y);
    const [r, g, b] = context.getImageData(0, 0, 1, 1).data;
    const swatch = h("span", { class: "swatch" });
    swatch.style.background = `rgb(${r} ${g} ${b})`;
    return swatch;
  }
}
