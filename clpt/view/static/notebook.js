// The front of a notebook: a picture that is steered, its state, and the inspector, in a cell.

import { Connection } from "./connection.js";
import { clock, h } from "./dom.js";
import { Inspector } from "./inspector.js";
import { Picture } from "./picture.js";
import { Steering } from "./steering.js";

// Messages by way of the widget's model.
class Model extends Connection {
  constructor(model) {
    super();
    this.model = model;
    this.heard = (message, buffers) => {
      if (message.type !== "frame") this.emit(message.type, message);
      else if (buffers?.[0]) this.take(message.header, buffers[0]);
    };
    model.on("msg:custom", this.heard);
  }

  send(name, values = {}) {
    this.model.send({ do: name, ...values });
  }

  leave() {
    this.send("watch", { watching: false });
    this.model.off("msg:custom", this.heard);
  }
}

function render({ model, el }) {
  const connection = new Model(model);
  const canvas = h("canvas", { class: "picture", tabIndex: 0, ariaLabel: "the picture: drag to orbit" });
  const overlay = h("canvas", { class: "overlay", ariaHidden: "true" });
  const room = h("div", { class: "room" }, h("div", { class: "frame" }, canvas, overlay));
  const phase = h("span", { class: "phase" }, "preparing kernels");
  const pane = h("div", { class: "pane", hidden: true });
  let paused = false;
  const button = (text, title, run) => h("button", { title, onclick: run }, text);
  const pause = button("pause", "let the picture rest, or go on", () => connection.send("pause", { paused: !paused }));
  const pixel = button("pixel", "values and spectrum of the pixel under the pointer", () => {
    pane.hidden = !pane.hidden;
    pixel.setAttribute("aria-pressed", !pane.hidden);
  });
  const tools = h("div", { class: "tools" }, phase, pause, button("home", "the first camera", () => connection.send("home")),
    pixel, button("stop", "end the render; the picture stays", () => connection.send("stop")));
  el.replaceChildren(h("div", { class: "clpt" }, tools, h("div", { class: "both" }, room, pane)));

  const picture = new Picture(canvas, overlay, connection, room);
  const steering = new Steering(picture, connection, [], canvas);
  const inspector = new Inspector(pane, picture, connection, steering);
  connection.addEventListener("state", ({ detail }) => {
    const [width, height] = detail.film;
    room.style.cssText = `aspect-ratio: ${width} / ${height}; max-width: ${width}px`;
    paused = detail.paused;
    pause.textContent = paused ? "go on" : "pause";
  });
  connection.addEventListener("status", ({ detail }) => {
    const { phase: name, samples, spp, seconds } = detail;
    phase.textContent = name === "preparing" ? "preparing kernels" : name === "moving" ? name : `${name}  ${Math.floor(samples)}/${spp}  ${clock(seconds)}`;
  });
  connection.addEventListener("error", ({ detail }) => { phase.textContent = detail.text; });
  connection.addEventListener("stopped", () => { tools.replaceChildren(h("span", { class: "phase" }, "stopped")); });
  connection.send("watch", { watching: true });
  el.clpt = { connection, picture, inspector };
  return () => connection.leave();
}

export default { render };
