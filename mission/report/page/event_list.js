// Everything that happened, with its cause, as `dive explain` prints it.

import {lastIndexAt} from './data.js';
import {clock, element} from './format.js';

const MAX_EVENTS = 4000;
const KINDS = {
  transition: 'transitions',
  failsafe: 'failsafes',
  plan: 'plan requests',
  answer: 'plan answers',
  action: 'actions',
  operator: 'operator',
  map: 'obstacles',
  collision: 'collisions',
  gap: 'gaps',
};

export class EventList {
  constructor(host, events, cursor) {
    this.cursor = cursor;
    this.all = events.slice(0, MAX_EVENTS);
    this.hidden = new Set();
    this.list = element('ol', {'aria-label': 'Events in order of time'});
    const kinds = [...new Set(this.all.map((event) => event.kind))];
    host.append(
        element('h2', {}, 'Events and their causes'),
        element(
            'div', {class: 'filters', role: 'group', 'aria-label': 'Kinds of events'},
            ...kinds.map((kind) => this.filter(kind))),
        this.list);
    if (events.length > MAX_EVENTS) {
      host.append(element(
          'p', {class: 'muted'},
          `The first ${MAX_EVENTS} of ${events.length} events; dive explain prints all.`));
    }
    this.fill();
    cursor.subscribe((t) => this.move(t));
  }

  filter(kind) {
    const box = element('input', {
      type: 'checkbox',
      checked: true,
      onchange: () => {
        if (box.checked)
          this.hidden.delete(kind);
        else
          this.hidden.add(kind);
        this.fill();
        this.move(this.cursor.time);
      }
    });
    return element('label', {}, box, KINDS[kind] ?? kind);
  }

  fill() {
    this.events = this.all.filter((event) => !this.hidden.has(event.kind));
    this.times = this.events.map((event) => event.t);
    this.buttons = this.events.map((event) => this.row(event));
    this.list.replaceChildren(...this.buttons.map((button) => element('li', {}, button)));
    this.current = -1;
  }

  row(event) {
    return element(
        'button', {type: 'button', onclick: () => this.cursor.set(event.t)},
        element('time', {}, clock(event.t)),
        element('span', {class: `kind ${event.kind}`}, event.kind),
        element(
            'span', {class: 'text'}, event.what,
            event.reason ? element('small', {}, event.reason) : null));
  }

  move(t) {
    const next = lastIndexAt(this.times, t + 1e-6);
    if (next === this.current) return;
    this.buttons[this.current]?.removeAttribute('aria-current');
    this.current = next;
    const button = this.buttons[next];
    if (!button) return;
    button.setAttribute('aria-current', 'true');
    // The page itself must not scroll.
    const top = button.offsetTop - this.list.offsetTop;
    if (top < this.list.scrollTop ||
        top > this.list.scrollTop + this.list.clientHeight - button.offsetHeight) {
      this.list.scrollTop = Math.max(top - this.list.clientHeight / 2, 0);
    }
  }

  shown() {
    return String(this.current);
  }
}
