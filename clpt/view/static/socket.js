// The page's connection: a socket to the server that served it, opened again whenever it is lost.

import { Connection } from "./connection.js";

const AGAIN_MS = [500, 1000, 2000, 4000];

export class Socket extends Connection {
  constructor() {
    super();
    this.tries = 0;
    this.open();
  }

  open() {
    const address = new URL("socket", location);
    address.protocol = location.protocol === "https:" ? "wss:" : "ws:";
    this.socket = new WebSocket(address);
    this.socket.binaryType = "arraybuffer";
    this.socket.onopen = () => { this.tries = 0; this.emit("open"); };
    this.socket.onmessage = ({ data }) => this.receive(data);
    this.socket.onclose = ({ code, reason }) => {
      this.emit("closed", { code, reason });
      setTimeout(() => this.open(), AGAIN_MS[Math.min(this.tries++, AGAIN_MS.length - 1)]);
    };
  }

  receive(data) {
    if (typeof data === "string") {
      const message = JSON.parse(data);
      this.emit(message.type, message);
      return;
    }
    const length = new DataView(data).getUint32(0, true);
    const header = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
    this.take(header, new Uint8Array(data, 4 + length));
  }

  send(name, values = {}) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify({ do: name, ...values }));
  }
}
