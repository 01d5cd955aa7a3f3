"use strict";
/* The connection to hrsynth: numbered requests, one at a time in each of the two processes of this tab.
   Of requests on the same channel only the newest waits; they are complete, so they are sent again after an interruption. */

class Refused extends Error {
  constructor(message, kind) { super(message); this.kind = kind; }
}

class Link {
  /* `onstart(first message)` at the first connection and `onback(first message)`, awaited, at each later one. */
  constructor({ onstart, onback, onlost }) {
    Object.assign(this, { onstart, onback, onlost, number: 0, ready: false, pause: Link.PAUSE });
    this.lanes = { mover: { waiting: new Map(), sent: null }, desk: { waiting: new Map(), sent: null } };
    this.connect();
  }

  connect() {
    const address = new URL("live", location.href);
    address.protocol = address.protocol.replace("http", "ws");
    this.socket = new WebSocket(address);
    let first = true;
    this.socket.onmessage = ({ data }) => {
      const said = JSON.parse(data);
      if (said.tab !== undefined && first) this.begin(said);
      else if (first) this.refused = said.error;
      else this.answered(said);
      first = false;
    };
    this.socket.onclose = () => this.lost();
  }

  async begin(said) {
    this.tab = said.tab;
    this.pause = Link.PAUSE;
    if (this.started) await this.onback(said);
    this.ready = true;
    if (!this.started) { this.started = true; this.onstart(said); }
    Object.values(this.lanes).forEach((lane) => this.next(lane));
  }

  /* Reconnect at growing intervals; the present request waits, with a limited number of tries. */
  lost() {
    this.ready = false;
    for (const lane of Object.values(this.lanes)) {
      const ask = lane.sent;
      lane.sent = null;
      if (!ask) continue;
      ask.tries += 1;
      if (ask.tries >= Link.TRIES) ask.fail(new Refused("the connection was interrupted twice during this request", "Lost"));
      else if (lane.waiting.has(ask.channel)) ask.done(null);
      else lane.waiting.set(ask.channel, ask);
    }
    this.onlost(this.refused);
    if (this.refused) return;
    setTimeout(() => this.connect(), this.pause);
    this.pause = Math.min(2 * this.pause, Link.LONGEST);
  }

  /* `fields`, or a function called when it is sent. Returns the answer, null if a newer request on the channel replaced it or it was cancelled; throws Refused. */
  ask(kind, fields = {}, channel = kind) {
    const lane = this.lanes[kind === "move" ? "mover" : "desk"];
    return new Promise((done, fail) => {
      lane.waiting.get(channel)?.done(null);
      lane.waiting.delete(channel);
      lane.waiting.set(channel, { kind, fields, channel, done, fail, tries: 0 });
      this.next(lane);
    });
  }

  /* Send the next request, if none is under way. */
  next(lane) {
    if (lane.sent || !this.ready) return;
    const [ask] = [...lane.waiting.values()].sort((one, other) => Link.order(one) - Link.order(other));
    if (!ask) return;
    lane.waiting.delete(ask.channel);
    lane.sent = ask;
    ask.n = this.number += 1;
    const fields = typeof ask.fields === "function" ? ask.fields() : ask.fields;
    this.socket.send(JSON.stringify({ n: ask.n, ask: ask.kind, ...fields }));
  }

  static order(ask) { return Link.LATE.indexOf(ask.kind); }

  /* Every answer to a drag is used; of others only that without a newer request waiting. */
  answered(said) {
    const lane = Object.values(this.lanes).find(({ sent }) => sent?.n === said.n);
    if (!lane) return;
    const ask = lane.sent;
    lane.sent = null;
    const replaced = lane === this.lanes.desk && lane.waiting.has(ask.channel);
    this.next(lane);
    if (replaced) ask.done(null);
    else if (said.error !== undefined) ask.fail(new Refused(said.error, said.kind));
    else ask.done(said.answer);
  }

  /* Cancel the requests on a channel. */
  cancel(channel) {
    for (const lane of Object.values(this.lanes)) {
      lane.waiting.get(channel)?.done(null);
      lane.waiting.delete(channel);
      if (lane.sent?.channel !== channel) continue;
      this.socket.send(JSON.stringify({ n: (this.number += 1), ask: "cancel", of: lane.sent.n }));
      lane.sent.done(null);
      lane.sent = null;
      this.next(lane);
    }
  }

  /* Send a file to the folder of this tab; the name under which it is opened. */
  async upload(file) {
    const address = `upload?tab=${encodeURIComponent(this.tab)}&name=${encodeURIComponent(file.name)}`;
    const reply = await fetch(address, { method: "POST", body: file }).catch(() => null);
    if (!reply) throw new Refused(`${file.name} was not sent: the connection is interrupted`, "Lost");
    const said = await reply.json().catch(() => ({}));
    if (!reply.ok) throw new Refused(said.error || `${file.name} was refused (${reply.status})`, "BadRequest");
    return said.file;
  }
}
Link.PAUSE = 500;       /* ms before the connection is tried again */
Link.LONGEST = 5000;
Link.TRIES = 2;
Link.LATE = ["gallery", "answer"];  /* requests that wait for all others */
