// The page: it wires the socket, the picture, the steering and the side together.

import { clock, h } from "./dom.js";
import { Inspector } from "./inspector.js";
import { Tabs, renderPane, scenePane, viewPane } from "./panes.js";
import { Picture } from "./picture.js";
import { Socket } from "./socket.js";
import { GESTURES, Steering } from "./steering.js";

history.replaceState(null, "", location.pathname); // the token is used up; nobody need see it

const $ = (id) => document.getElementById(id);
const connection = new Socket();
const picture = new Picture($("picture"), $("overlay"), connection, $("stage"));
const open = new Set(["camera", "material"]);
const figures = { frames: 0, perSecond: 0, times: [] };
let state = null;
let steers = true;

const display = {
  exposure: 0,
  tone: "none",
  set(changes) {
    Object.assign(display, changes);
    connection.set("display", { exposure: display.exposure, tone: display.tone });
  },
};

// A message for some seconds; parts: buttons behind its text.
function note(text, kind = "", ...parts) {
  const item = h("li", { class: kind }, text, parts);
  $("notes").append(item);
  setTimeout(() => item.remove(), kind === "error" ? 8000 : 4000);
  while ($("notes").children.length > 4) $("notes").firstChild.remove();
}

// What keys and buttons do. button: the word in the header, if it has one; group: which buttons stand together.
const actions = [
  { keys: [" "], text: "pause, go on", run: () => connection.send("pause", { paused: !state?.paused }), button: "Pause", group: "render" },
  { keys: ["h"], text: "the camera of the file", run: () => connection.send("home"), button: "Reset view", group: "camera" },
  { keys: ["p"], text: "click the point that the camera turns about", run: () => steering.choose("pivot"), tool: "pivot", button: "Orbit point", group: "camera" },
  { keys: ["f"], text: "click what the lens focuses on", run: () => steering.choose("focus"), tool: "focus", button: "Focus", group: "camera" },
  { keys: ["x"], text: "click an object to hide it", run: () => steering.choose("hide"), tool: "hide", button: "Hide", group: "scene" },
  { keys: ["X"], text: "show all objects", run: () => connection.send("show_all") },
  { keys: ["z"], text: "undo the last change of the scene", run: () => undo("undo"), button: "Undo", group: "scene" },
  { keys: ["Z"], text: "redo what was undone", run: () => undo("redo") },
  { keys: ["r"], text: "render a region, or the whole picture again", run: region, tool: "region", button: "Region", group: "picture" },
  { keys: ["c"], text: "keep the picture, and wipe between it and the next one", run: compare, button: "Compare", group: "picture" },
  { keys: ["v"], text: "the difference from the kept picture, eight times as bright", run: differ },
  { keys: ["m"], text: "the next layer in place of the picture: depth, normals, error ...", run: nextMap, button: "Layers", group: "picture" },
  { keys: ["+", "="], text: "brighter by a third of a stop", run: () => expose(1 / 3) },
  { keys: ["-"], text: "darker by a third of a stop", run: () => expose(-1 / 3) },
  { keys: ["0"], text: "exposure 0", run: () => expose(-display.exposure) },
  { keys: ["t"], text: "the next tone curve", run: nextTone },
  { keys: ["1"], text: "one pixel for one of the screen, or all of the picture", run: () => { picture.actual = !picture.actual; $("stage").classList.toggle("actual", picture.actual); picture.fit(); } },
  { keys: ["g"], text: "save a .png", run: () => save("png"), button: "Save", group: "file" },
  { keys: ["l"], text: "copy where the camera is and looks, as look_at", run: () => connection.send("look_at") },
  { keys: ["y"], text: "copy the view as text; paste it, or drop its file, to open it", run: () => connection.send("copy_view") },
  { keys: ["i"], text: "an address for another viewer", run: () => connection.send("invite") },
  { keys: ["Escape"], text: "leave a tool", run: () => { if (steering.tool) steering.choose(steering.tool); } },
  { keys: ["?"], text: "all keys and gestures", run: help, button: "Keys", group: "file" },
];
const steering = new Steering(picture, connection, actions, window);

const tabs = new Tabs($("tabs"), $("panes"), [["pixel", "Pixel"], ["view", "View"], ["scene", "Scene"], ["render", "Render"]]);
const inspector = new Inspector(tabs.panes.pixel, picture, connection, steering, editMaterial);
tabs.onopen = (name) => {
  if (name === "render") connection.send("statistics");
  draw(name);
};

for (const action of actions.filter(({ button }) => button)) {
  action.element = h("button", { "data-group": action.group, title: `${action.text} (${action.keys[0] === " " ? "space" : action.keys[0]})`, onclick: () => { action.run(); } }, action.button);
  $("tools").append(action.element);
}

const firstOfGroup = new Map([...actions].reverse().filter(({ button }) => button).map((action) => [action.group, action.element]));
for (const element of firstOfGroup.values()) element.classList.add("first");

function draw(name = tabs.current) {
  if (!state) return;
  const pane = tabs.panes[name];
  if (name !== "pixel" && pane.contains(document.activeElement) && document.activeElement.matches("input[type=number], input[type=range], input[type=color]") && name !== "render") return;
  const top = $("panes").scrollTop;
  if (name === "view") pane.replaceChildren(...viewPane(state, connection, display));
  if (name === "scene") pane.replaceChildren(...scenePane(state, connection, open));
  if (name === "render") pane.replaceChildren(...renderPane(state, connection, figures, { save, fitted }));
  $("panes").scrollTop = top;
}

// Open the panel of a material, and show it.
function editMaterial(index) {
  const key = `material.${index}`;
  for (const one of ["material", key]) open.add(one);
  tabs.open("scene");
  tabs.panes.scene.querySelector(`[data-key="${key}"]`)?.scrollIntoView({ block: "start" });
}

// Save a file on the side of the server. It may wait for the end of a pass.
function save(what) {
  note(`saving ${what === "scene" || what === "view" ? `the ${what}` : `.${what}`} ...`);
  connection.send("save", { what });
}

// The picture as it is shown, as a file of the browser.
function download(name) {
  picture.now.toBlob((blob) => {
    const link = h("a", { href: URL.createObjectURL(blob), download: name });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  }, "image/png");
}

function undo(verb) {
  document.activeElement?.blur?.(); // a field that is edited would keep its number
  connection.send(verb);
}

// The film's size that has one pixel for each of the window's, in the film's shape.
function fitted() {
  const box = $("stage").getBoundingClientRect();
  const [width, height] = state.film;
  const scale = Math.min(box.width / width, box.height / height) * (window.devicePixelRatio || 1);
  return [width, height].map((length) => Math.max(1, Math.round(length * scale)));
}

function region() {
  if (picture.region) {
    picture.region = null;
    connection.send("region");
    picture.paintOverlay();
  } else steering.choose("region");
}

function compare() {
  if (picture.kept && picture.wipe !== null) {
    picture.kept = picture.wipe = null;
    picture.differs = false;
    connection.send("keep", { kept: false });
  } else {
    picture.keep();
    picture.wipe = 0.5;
    connection.send("keep", { kept: true });
    note("This picture is kept. Drag the line to wipe; v shows the difference.");
  }
  picture.paint();
}

function differ() {
  if (!picture.kept) { note("Keep a picture first: c"); return; }
  picture.differs = !picture.differs;
  picture.paint();
}

function expose(by) {
  display.set({ exposure: Math.round(Math.max(-20, Math.min(20, display.exposure + by)) * 1000) / 1000 });
  draw();
}

function nextTone() {
  const { tones } = state.names;
  display.set({ tone: tones[(tones.indexOf(display.tone) + 1) % tones.length] });
  note(`tone curve: ${display.tone}`);
  draw();
}

// What the colours of a map mean, below it.
function legend({ legend: told }) {
  const [low, bar, high] = $("legend").children;
  $("legend").hidden = !told;
  if (!told) return;
  [low.textContent, high.textContent] = [told.low, told.high];
  bar.style.background = `linear-gradient(90deg, ${told.colours.join(", ")})`;
}

function nextMap() {
  const { maps } = state.names;
  const name = maps[(maps.indexOf(state.look.shows) + 1) % maps.length];
  connection.send("shows", { name });
  note(name.replaceAll("_", " "));
}

function help() {
  const dialog = $("help");
  if (dialog.open) { dialog.close(); return; }
  const key = (name) => h("kbd", {}, name === " " ? "space" : name === "Escape" ? "Esc" : name);
  const rows = (pairs) => h("dl", {}, pairs.map(([keys, text]) => [h("dt", {}, keys), h("dd", {}, text)]));
  dialog.replaceChildren(
    h("div", { class: "columns" },
      h("div", {}, h("h2", {}, "Pointer"), rows(GESTURES.map(([gesture, text]) => [gesture, text])),
        h("h2", {}, "Moving"), rows([[["W", "A", "S", "D", "Q", "E"].map(key), "fly; Q and E: down, up"], [["←", "→", "↑", "↓"].map(key), "orbit"]])),
      h("div", {}, h("h2", {}, "Keys"), rows(actions.map(({ keys, text }) => [keys.map(key), text])))),
    h("button", { class: "wide", onclick: () => dialog.close() }, "close"));
  dialog.showModal();
  dialog.scrollTop = 0; // the button below has the focus
}

function hint(text) {
  $("hint").hidden = !text;
  $("hint").textContent = text;
}

// For the first seconds, until the picture is touched.
function welcome() {
  const touch = window.matchMedia("(pointer: coarse)").matches;
  hint(touch ? "drag: orbit    pinch: zoom    tap: a pixel" : "drag: orbit    wheel: zoom    click: a pixel    ?: keys");
  const end = () => { if (!steering.tool) hint(""); };
  setTimeout(end, 8000);
  picture.canvas.addEventListener("pointerdown", end, { once: true });
}

steering.addEventListener("tool", ({ detail }) => {
  const hints = { pivot: "click the point to turn about", focus: "click what is to be sharp", hide: "click what to hide", region: "drag a rectangle" };
  hint(hints[detail] ?? "");
  for (const { tool, element } of actions) if (tool && element) element.setAttribute("aria-pressed", tool === detail);
});
steering.addEventListener("hide", ({ detail }) => connection.send("hide_at", detail));
steering.addEventListener("zoom", ({ detail }) => {
  const camera = state?.panels.find(({ target }) => target === "camera");
  const fov = camera?.parameters.find(({ key }) => key === "fov");
  if (!fov) return;
  fov.value = Math.min(170, Math.max(0.1, fov.value * Math.exp(-detail)));
  connection.set("field_of_view", { degrees: fov.value });
});

connection.addEventListener("state", ({ detail }) => {
  state = detail;
  Object.assign(display, detail.display);
  document.title = `${detail.name || "scene"} – clpt`;
  $("name").textContent = detail.name || "scene";
  picture.region = detail.look.region;
  if (!detail.compares && !picture.kept) picture.wipe = null;
  for (const { button, element } of actions) if (button === "Pause") { element.textContent = detail.paused ? "Go on" : "Pause"; }
  picture.paintOverlay();
  draw();
});

connection.addEventListener("status", ({ detail }) => {
  Object.assign(figures, detail);
  if (detail.phase === "preparing") {
    $("phase").textContent = "preparing kernels";
    return;
  }
  const share = detail.spp ? Math.min(1, detail.samples / detail.spp) : 0;
  $("progress").firstElementChild.style.width = `${100 * share}%`;
  $("phase").textContent = detail.phase === "moving" ? "moving" : `${detail.phase}  ${Math.floor(detail.samples)}/${detail.spp}  ${clock(detail.seconds)}`;
  if (tabs.current === "render" && !tabs.panes.render.contains(document.activeElement)) draw("render");
});

picture.addEventListener("shown", ({ detail }) => {
  figures.frames += 1;
  figures.difference = detail.difference;
  figures.times = [...figures.times.slice(-19), performance.now()];
  const span = figures.times.at(-1) - figures.times[0];
  figures.perSecond = span ? ((figures.times.length - 1) / span) * 1000 : 0;
  if (!document.body.classList.contains("shows")) welcome();
  document.body.classList.add("shows");
  $("solid").hidden = !detail.solid;
  legend(detail);
});

connection.addEventListener("wheel", ({ detail }) => {
  if (steers && !detail.steers) note("Another viewer steers. Take the wheel by the button above.");
  steers = detail.steers;
  document.body.classList.toggle("watches", !steers);
  let button = $("steer");
  if (!steers && !button) {
    button = h("button", { id: "steer", onclick: () => connection.send("steer") }, "Take the wheel");
    $("tools").prepend(button);
  }
  if (steers) button?.remove();
});
connection.addEventListener("statistics", ({ detail }) => { figures.statistics = detail; if (tabs.current === "render") draw(); });
connection.addEventListener("saved", ({ detail }) => note(`saved ${detail.name} in the folder of clpt view`, "",
  ...(detail.what === "png" ? [h("button", { class: "link", onclick: () => download(detail.name) }, "download it")] : [])));
connection.addEventListener("pivot", () => note("The camera turns about this point."));
connection.addEventListener("look_at", ({ detail }) => {
  const point = (values) => `[${values.join(", ")}]`;
  copy(`transforms.look_at(${point(detail.origin)}, ${point(detail.target)}, ${point(detail.up)})`, "look_at is in the clipboard.");
});
connection.addEventListener("invitation", ({ detail }) => copy(detail.address, "An address for one more viewer is in the clipboard."));
connection.addEventListener("view", ({ detail }) => copy(JSON.stringify(detail.view), "The view is in the clipboard; paste it here to come back."));
connection.addEventListener("error", ({ detail }) => note(detail.text, "error"));
connection.addEventListener("note", ({ detail }) => note(detail.text));
connection.addEventListener("closed", ({ detail }) => {
  $("phase").textContent = detail.code === 1013 ? "there are too many viewers" : "the server is away";
  document.body.classList.add("away");
});
connection.addEventListener("open", () => { document.body.classList.remove("away"); picture.latest = 0; });

async function copy(text, told) {
  try {
    await navigator.clipboard.writeText(text);
    note(told);
  } catch {
    note(text);
  }
}

// A view that was copied or saved: its text.
function openView(text) {
  let view;
  try {
    view = JSON.parse(text);
  } catch {
    view = null;
  }
  if (view?.camera) connection.send("open_view", { camera: view.camera, exposure: 0, tone: "none", ...view.display });
  else note("That is no view.", "error");
}
window.addEventListener("paste", (event) => {
  if (!event.target.closest?.("input, select, textarea")) openView(event.clipboardData.getData("text"));
});
window.addEventListener("dragover", (event) => event.preventDefault());
window.addEventListener("drop", async (event) => {
  event.preventDefault();
  const [file] = event.dataTransfer.files;
  if (file) openView(await file.text());
});

// Undo by the keys that people know; in a field they are the field's own.
window.addEventListener("keydown", (event) => {
  if (!(event.ctrlKey || event.metaKey) || event.altKey || event.target.closest?.("input:not([type=range]):not([type=checkbox]), textarea, dialog")) return;
  const verb = { z: event.shiftKey ? "redo" : "undo", y: "redo" }[event.key.toLowerCase()];
  if (!verb) return;
  event.preventDefault();
  undo(verb);
});

// The picture has an outline only where Tab has led to it.
window.addEventListener("keydown", ({ key }) => { if (key === "Tab") document.body.classList.add("tabs"); });
window.addEventListener("pointerdown", () => document.body.classList.remove("tabs"));

window.clpt = { connection, picture, inspector, tabs, figures, get state() { return state; } };
