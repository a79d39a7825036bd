// Controls for values of a scene: what each is made of comes from the scene's own declarations.

import { h, short } from "./dom.js";
import { curveEditor, sparkline } from "./plot.js";

// A row: label, control, unit; the description is its tip.
export function row(label, doc, ...parts) {
  return h("div", { class: "row", title: doc }, h("span", { class: "label" }, label), h("span", { class: "control" }, parts));
}

export function choice(names, value, change, label = "") {
  const options = names.map((name) => {
    const [text, key] = Array.isArray(name) ? name : [String(name ?? "none").replaceAll("_", " "), name];
    return h("option", { value: JSON.stringify(key), selected: key === value }, text);
  });
  return h("select", { "aria-label": label, onchange: (event) => change(JSON.parse(event.target.value)) }, options);
}

export function flag(value, change, label = "") {
  return h("input", { type: "checkbox", checked: Boolean(value), "aria-label": label, onchange: (event) => change(event.target.checked) });
}

// A number: a slider where it has limits, or goes from zero by powers; and a field for exact values.
export function number(value, { low, high, whole, label = "" }, change) {
  const ranged = low !== null && low !== undefined && high !== null && high !== undefined;
  const powers = !ranged && low === 0;
  const most = Math.max(1, value * 4 || 1);
  const toSlider = (v) => (powers ? Math.sqrt(Math.min(v, most) / most) : v);
  const fromSlider = (s) => (powers ? Number((s * s * most).toPrecision(3)) : s);
  const field = h("input", {
    type: "number", class: "field", step: "any", value: short(value, 6), "aria-label": label,
    min: low ?? undefined, max: high ?? undefined,
    onchange() {
      const wanted = Number(field.value);
      if (!Number.isFinite(wanted)) return;
      let v = Math.min(high ?? Infinity, Math.max(low ?? -Infinity, wanted));
      if (whole) v = Math.round(v);
      field.value = short(v, 6);
      if (slider) slider.value = toSlider(v);
      change(v);
    },
  });
  const slider = ranged || powers
    ? h("input", {
      type: "range", min: powers ? 0 : low, max: powers ? 1 : high,
      step: whole ? 1 : (powers ? 1 : high - low) / 500, value: toSlider(value), "aria-label": label,
      oninput() {
        const v = fromSlider(Number(slider.value));
        field.value = short(v, 4);
        change(v);
      },
    })
    : null;
  return [slider, field].filter(Boolean);
}

export function numbers(values, change, label = "") {
  const given = [...values];
  return given.map((value, i) => h("input", {
    type: "number", class: "field", step: "any", value: short(value, 5), "aria-label": `${label} ${i + 1}`,
    onchange(event) {
      const v = Number(event.target.value);
      if (Number.isFinite(v)) { given[i] = v; change([...given]); }
    },
  }));
}

const encode = (v) => (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055);
const decode = (v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);

// A colour, linear Rec. 709; beyond 1 it has a strength.
function colour([...rgb], limited, change, label) {
  let strength = Math.max(1, ...rgb);
  const hex = () => "#" + rgb.map((v) => Math.round(255 * encode(Math.min(1, Math.max(0, v / strength)))).toString(16).padStart(2, "0")).join("");
  const tell = () => change(rgb.map((v) => Number(v.toPrecision(5))));
  const parts = [h("input", {
    type: "color", value: hex(), "aria-label": label,
    oninput(event) {
      rgb = [1, 3, 5].map((i) => strength * decode(parseInt(event.target.value.slice(i, i + 2), 16) / 255));
      tell();
    },
  })];
  if (!limited) {
    parts.push(...number(strength, { low: 0, label: `${label} strength` }, (v) => {
      const before = strength;
      strength = Math.max(v, 1e-6);
      rgb = rgb.map((one) => (one * strength) / before);
      tell();
    }));
  }
  return parts;
}

const MOST_POINTS = 16; // of a table that can be dragged

// The points of a curve that can be dragged, null of any other value.
function pointsOf(value) {
  if (value?.type === "tabulated" && value.lambdas.length <= MOST_POINTS) return value.lambdas.map((nm, i) => [nm, value.values[i]]);
  return value?.values && !value.type ? value.values.map((point) => [...point]) : null;
}

const AT = [400, 440, 480, 520, 560, 600, 640, 680, 720];

// A spectrum in the form that it has, and a choice of other forms.
function spectrum(parameter, names, change) {
  const { value, role, curve, key } = parameter;
  const limited = role === "reflectance";
  const named = { emission: names.illuminants, index: names.glasses }[role] ?? [];
  const form = Array.isArray(value) ? "colour" : typeof value === "number" ? "number" : typeof value === "string" ? "name" : pointsOf(value) ? "curve" : value?.type === "illuminant" ? "name" : "other";
  const middle = curve ? curve[Math.floor(curve.length / 2)] : 0.5;
  const sampled = () => AT.map((nm) => [nm, Number((curve ? interpolate(curve, nm) : 0.5).toPrecision(4))]);
  const made = {
    number: () => Number((limited ? Math.min(1, middle) : middle).toPrecision(3)),
    colour: () => [middle, middle, middle].map((v) => Number((limited ? Math.min(1, v) : v).toPrecision(3))),
    curve: () => ({ values: sampled() }),
    name: () => (role === "index" ? named[0] : { type: "illuminant", name: named[0], scale: middle || 1 }),
  };
  const forms = ["number", "colour", "curve", ...(named.length ? ["name"] : []), ...(form === "other" ? ["other"] : [])]
    .filter((one) => one !== "colour" || !["index", "coefficient"].includes(role) || form === "colour");
  const head = choice(forms.map((one) => [one === "other" ? nameOf(value) : one === "name" && role === "emission" ? "lamp" : one, one]), form,
    (wanted) => { if (made[wanted]) change(made[wanted](), true); }, `${key}: form`);
  const parts = [head];
  const below = [];
  if (form === "number") parts.push(...number(value, { low: role === "factor" ? null : 0, high: limited ? 1 : null, label: key }, change));
  if (form === "colour") parts.push(...colour(value, limited, change, key));
  if (form === "curve") below.push(curveEditor(pointsOf(value), limited ? 1 : undefined, (points) => change({ values: points })));
  if (form === "name" && typeof value === "string") parts.push(choice(named, value, (name) => change(name, true), key));
  if (form === "name" && typeof value === "object") {
    parts.push(choice(named, value.name, (name) => change({ ...value, name }, true), key));
    below.push(h("div", { class: "indent" }, row("scale", "luminance", number(value.scale, { low: 0, label: "scale" }, (scale) => change({ ...value, scale })))));
  }
  if (form === "other") {
    for (const [name, part] of Object.entries(value)) {
      if (typeof part === "number") {
        below.push(h("div", { class: "indent" }, row(name.replaceAll("_", " "), "", number(part, { low: 0, label: name }, (v) => change({ ...value, [name]: v })))));
      }
    }
  }
  if (curve && form !== "curve" && curve.some((v) => v !== curve[0])) parts.push(sparkline(curve));
  return { parts, below };
}

function nameOf(value) {
  return value.type === "tabulated" ? `table of ${value.values.length}` : value.type.replaceAll("_", " ");
}

function interpolate(curve, nm) {
  const at = ((nm - 380) / 400) * (curve.length - 1);
  const i = Math.min(curve.length - 2, Math.max(0, Math.floor(at)));
  return curve[i] + (curve[i + 1] - curve[i]) * (at - i);
}

// The control of a parameter. change: called with the value, and whether the panel must be made again.
export function parameterRow(parameter, names, change) {
  const { key, control, doc, unit, low, high, value, choices, optional, texture } = parameter;
  const label = key.replaceAll("_", " ");
  const tip = unit ? `${doc} [${unit}]` : doc;
  const suffix = unit && !["degrees", "pixels"].includes(unit) ? [] : unit === "degrees" ? [h("i", { class: "unit" }, "°")] : [];
  if (texture) return row(label, tip, h("span", { class: "dim" }, `${texture.replaceAll("_", " ")} texture`));
  const limits = { low, high, label };
  const simple = {
    number: () => number(value, limits, change),
    whole: () => number(value, { ...limits, whole: true }, change),
    flag: () => flag(value, change, label),
    choice: () => choice(optional ? [null, ...choices] : choices, value, change, label),
    vector: () => numbers(value, change, label),
    numbers: () => numbers(value, change, label),
    white: () => (typeof value === "string" ? [choice([...choices, ["temperature", 6500]], value, (v) => change(v, true), label)]
      : typeof value === "number" ? [choice([...choices, ["temperature", value]], value, (v) => change(v, true), label), ...number(value, { low: 2000, high: 12000, label }, change)]
        : numbers(value, change, label)),
    number_or_auto: () => [choice([["auto", "auto"], ["number", typeof value === "number" ? value : 1]], value, (v) => change(v, true), label), ...(typeof value === "number" ? number(value, { low: 0, label }, change) : [])],
  }[control];
  if (value === null && control !== "choice") return row(label, tip, h("span", { class: "dim" }, "not shown here"));
  if (simple) return row(label, tip, simple(), suffix);
  const { parts, below } = spectrum(parameter, names, change);
  return h("div", { class: "spectrum" }, row(label, tip, parts), below);
}
