// The side: tabs of panes, whose controls are made from what the server tells of the scene.

import { bytes, h, many, short } from "./dom.js";
import { choice, flag, number, numbers, parameterRow, row } from "./controls.js";

export class Tabs {
  constructor(tabs, panes, names) {
    this.panes = {};
    this.tabs = {};
    for (const [name, title] of names) {
      this.tabs[name] = h("button", { role: "tab", id: `tab-${name}`, "aria-controls": `pane-${name}`, onclick: () => this.open(name) }, title);
      this.panes[name] = h("section", { role: "tabpanel", id: `pane-${name}`, "aria-labelledby": `tab-${name}` });
      tabs.append(this.tabs[name]);
      panes.append(this.panes[name]);
    }
    tabs.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
      if (!step) return;
      event.preventDefault();
      const order = names.map(([name]) => name);
      const next = order[(order.indexOf(this.current) + step + order.length) % order.length];
      this.open(next);
      this.tabs[next].focus();
    });
    this.open(names[0][0]);
  }

  open(name) {
    this.current = name;
    for (const [key, tab] of Object.entries(this.tabs)) {
      tab.setAttribute("aria-selected", key === name);
      tab.tabIndex = key === name ? 0 : -1;
      this.panes[key].hidden = key !== name;
    }
    this.onopen?.(name);
  }
}

export function section(title, open, ...children) {
  return h("details", { open }, h("summary", {}, title), h("div", { class: "body" }, children));
}

// How the picture is shown, and under which light.
export function viewPane(state, connection, display) {
  const { look } = state;
  const film = state.panels.find(({ target }) => target === "film");
  const send = (key, value) => connection.set("edit", { target: "film", index: 0, key, value }, `film.${key}`);
  const filmRow = (key) => parameterRow(film.parameters.find((one) => one.key === key), state.names, (value) => send(key, value));
  const [low, high] = state.lambdas;
  const wavelength = (nm, width = look.width) => connection.set("wavelength", { nm, width });
  const parts = [
    section("Display", true,
      row("show", "the picture; how many samples each pixel has; how far it may be from the right value; or a layer of the film", choice(state.names.maps, look.shows, (name) => connection.send("shows", { name }), "show")),
      row("exposure", "brightness of the screen, in stops; the file is not changed", number(display.exposure, { low: -8, high: 8, label: "exposure" }, (v) => display.set({ exposure: v })), h("i", { class: "unit" }, "EV")),
      row("tone", "how brightness beyond the screen's is treated", choice(state.names.tones, display.tone, (v) => display.set({ tone: v }), "tone curve")),
      filmRow("white_balance"), filmRow("sensor")),
    section("Light", true,
      row("lamp", "all lights get the spectrum of this lamp, and keep their luminance; images stay", choice([["as in the scene", null], ...state.names.illuminants.map((name) => [name, name])], look.lamp, (name) => connection.send("lamp", { name }), "lamp")),
      state.mode === "spectral" ? row("one wavelength", "light of one wavelength alone", flag(look.wavelength !== null, (on) => wavelength(on ? (low + high) / 2 : null), "one wavelength alone")) : null,
      look.wavelength !== null ? row("nm", "its middle", number(look.wavelength, { low, high, label: "wavelength" }, (nm) => wavelength(nm))) : null,
      look.wavelength !== null ? row("width", "of the range [nm]", number(look.width, { low: 0.5, high: 100, label: "width" }, (width) => wavelength(look.wavelength, width))) : null),
  ];
  return parts;
}

// Panels for camera, lights, materials; objects to hide.
export function scenePane(state, connection, open) {
  const groups = { camera: [], light: [], emission: [], material: [], integrator: [] };
  for (const panel of state.panels) groups[panel.target]?.push(panel);
  const titles = { camera: "Camera", light: "Lights", emission: "Lamps", material: "Materials", integrator: "Integrator" };
  const parts = [];
  for (const [target, panels] of Object.entries(groups)) {
    if (!panels.length) continue;
    const bodies = panels.map((panel) => panelOf(panel, state, connection, open, panels.length > 1));
    parts.push(section(panels.length > 1 ? `${titles[target]} ${panels.length}` : titles[target], open.has(target), bodies));
    parts.at(-1).dataset.key = target;
  }
  const objects = state.objects.map((object, i) => h("label", { class: "object" },
    h("input", { type: "checkbox", checked: !state.look.hidden.includes(i), onchange: (event) => connection.send("hide", { shape: i, hidden: !event.target.checked }) }),
    h("span", {}, object.name), h("span", { class: "dim" }, object.kind)));
  parts.push(section(`Objects ${objects.length}`, open.has("objects"),
    state.look.hidden.length ? h("button", { class: "quiet", onclick: () => connection.send("show_all") }, `show all ${state.look.hidden.length} that are hidden`) : null, objects));
  parts.at(-1).dataset.key = "objects";
  if (state.edited) parts.push(h("button", { class: "wide", onclick: () => connection.send("restore") }, "as in the file again"));
  for (const part of parts) {
    part.addEventListener?.("toggle", () => (part.open ? open.add(part.dataset.key) : open.delete(part.dataset.key)));
  }
  return parts;
}

function panelOf(panel, state, connection, open, folded) {
  const key = `${panel.target}.${panel.index}`;
  const body = h("div", { class: "body" }, h("p", { class: "doc" }, panel.doc));
  const rows = () => panel.parameters.map((parameter) => {
    const made = () => parameterRow(parameter, state.names, (value, again) => {
      connection.set("edit", { target: panel.target, index: panel.index, key: parameter.key, value }, `${key}.${parameter.key}`);
      parameter.value = value;
      if (again) { const fresh = made(); current.replaceWith(fresh); current = fresh; }
    });
    let current = made();
    return current;
  });
  const kinds = panel.kinds.length
    ? row("kind", "of the material; parameters that both kinds have stay", choice([...new Set([panel.kind, ...panel.kinds])], panel.kind, (value) => connection.send("edit", { target: panel.target, index: panel.index, key: "type", value }), "kind"))
    : null;
  const metals = panel.metals.length
    ? row("metal", "its optical constants, in eta and k", choice([["choose", ""], ...panel.metals.map((name) => [name, name])], "", (value) => value && connection.send("edit", { target: panel.target, index: panel.index, key: "metal", value }), "metal"))
    : null;
  const place = panel.target === "camera"
    ? h("button", { class: "link", title: "origin, target and up, as Python", onclick: () => connection.send("look_at") }, "copy look_at") : null;
  if (!folded) return [h("p", { class: "kind" }, panel.kind.replaceAll("_", " ")), h("p", { class: "doc" }, panel.doc), kinds, metals, rows(), place];
  const details = h("details", { class: "inner", open: open.has(key) },
    h("summary", {}, panel.title, panel.title === panel.kind.replaceAll("_", " ") ? "" : h("span", { class: "dim" }, panel.kind.replaceAll("_", " "))), body);
  const fill = () => { if (details.open && body.children.length === 1) body.append(...[kinds, metals, ...rows()].filter(Boolean)); };
  details.addEventListener("toggle", (event) => {
    event.stopPropagation();
    if (details.open) open.add(key); else open.delete(key);
    fill();
  });
  details.dataset.key = key;
  fill();
  return details;
}

// Where the render ends, what it takes, and what is saved.
export function renderPane(state, connection, figures, { save, fitted }) {
  const stop = (spp, noise) => connection.send("stop_at", { spp, noise });
  const size = ([width, height]) => connection.send("size", { width, height });
  const saved = (what, title, tip) => h("button", { title: tip, onclick: () => save(what) }, title);
  const difference = figures.difference;
  return [
    section("Render", true,
      row("size", "of the picture, width and height in pixels", numbers(state.film, (lengths) => size(lengths.map((length) => Math.max(1, Math.round(length)))), "size"),
        h("button", { class: "quiet", title: "one pixel for each of the window's", onclick: () => size(fitted()) }, "fit")),
      row("samples", "of every pixel, at most", number(state.spp, { whole: true, label: "samples" }, (spp) => stop(Math.max(1, spp), state.noise))),
      row("noise", `pixels with less${state.look.denoises ? " after denoising" : ""} get no more samples; empty: all get as many`, choice([["all samples", null], ["5 %", 0.05], ["2 %", 0.02], ["1 %", 0.01], ["0.5 %", 0.005], ...(state.noise && ![0.05, 0.02, 0.01, 0.005].includes(state.noise) ? [[`${short(100 * state.noise)} %`, state.noise]] : [])], state.noise, (noise) => stop(state.spp, noise), "noise")),
      h("div", { class: "buttons" }, h("button", { onclick: () => connection.send("pause", { paused: !state.paused }) }, state.paused ? "go on" : "pause"),
        h("button", { onclick: () => connection.send("restart") }, "begin again"),
        state.look.region ? h("button", { onclick: () => connection.send("region") }, "whole picture") : null)),
    section("Save", true,
      h("div", { class: "buttons" }, saved("png", ".png", "as it is shown"), saved("exr", ".exr", "linear, with all bands"), saved("scene", "scene.json", "with all edits"), saved("view", "view", "the camera and the display")),
      state.saves ? h("p", { class: "doc" }, "new files in the folder that clpt view was given") : null),
    difference ? section("Against the kept picture", true, list([
      ["mean difference", `${short(100 * difference.relative_mean, 3)} %`], ["root mean square", `${short(100 * difference.relative_rms, 3)} %`],
      ["brighter by", `${short(100 * difference.bias, 3)} %`]])) : null,
    section("Statistics", true, list([
      ["samples/s", many(figures.samples_per_second ?? 0)], ["rays/s", many(figures.rays_per_second ?? 0)],
      ["frames shown", `${figures.frames} (${short(figures.perSecond, 2)}/s)`],
      ...(figures.active < 1 ? [["pixels left", `${Math.round(100 * figures.active)} %`]] : []), ...statistics(figures.statistics), ["device", state.device]])),
  ].filter(Boolean);
}

function statistics(found) {
  if (!found) return [];
  const { stats } = found;
  return [
    ["integrator", stats.reason ? `${stats.integrator}: ${stats.reason}` : stats.integrator],
    ["triangles", many(stats.triangles)], ["instances", many(stats.instances)], ["lights", many(stats.lights)],
    ["memory", bytes(stats.memory)], ["programs", `${stats.programs}, ${stats.programs_cached} cached`],
    ["ready after", `${short(stats.seconds.ready, 3)} s`],
  ];
}

function list(rows) {
  return h("dl", {}, rows.map(([name, text]) => [h("dt", {}, name), h("dd", {}, String(text))]));
}
