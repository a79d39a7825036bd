// What is said to the render and what it says, whatever carries it: a socket, or a notebook.

const LEAST_MS = 30; // between two sends of what can be added up

// Tells of messages by events named as their type, and of pictures by `frame`.
export class Connection extends EventTarget {
  constructor() {
    super();
    this.waiting = new Map(); // by command: values that are added up, or replaced
  }

  emit(name, detail = {}) {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }

  // Tell of a picture that has come: its header, and the bytes of its file.
  take(header, bytes) {
    this.emit("frame", { header, file: new Blob([bytes], { type: `image/${header.format}` }) });
  }

  // Send a drag: what comes too soon is added to what comes next.
  add(name, values) {
    const sum = this.waiting.get(name);
    if (sum) for (const key of Object.keys(values)) sum[key] += values[key];
    else this.waiting.set(name, { ...values });
    this.schedule();
  }

  // Send a setting: of what comes too soon the last counts. key: what it replaces.
  set(name, values, key = name) {
    this.waiting.set(key, { ...values, "": name });
    this.schedule();
  }

  schedule() {
    if (this.timer) return;
    const wait = Math.max(0, LEAST_MS - (performance.now() - (this.last ?? 0)));
    this.timer = setTimeout(() => {
      this.timer = undefined;
      this.last = performance.now();
      const all = [...this.waiting];
      this.waiting.clear();
      for (const [key, { "": name, ...values }] of all) this.send(name ?? key, values);
    }, wait);
  }
}
