// The plans: why each was requested, how long it took and what it promised.

import {lastIndexAt} from './data.js';
import {clock, element, number} from './format.js';

function cell(text, kind = '') {
  return element('td', {class: kind}, text);
}

function statusOf(path) {
  const reason = path.reason && !path.accepted ? `: ${path.reason}` : '';
  return (path.accepted ? path.status : `${path.status}, not accepted`) + reason;
}

function timesOf(path, isDive) {
  if (!isDive) return [cell(number(path.time_ms, 0, 'ms'), 'number')];
  const took = path.answered_s === null ? '–' : number(path.answered_s - path.asked_s, 2, 's');
  return [cell(clock(path.asked_s), 'number'), cell(took, 'number')];
}

export class PathTable {
  /** `onSelect(index)` is called when a row is chosen. */
  constructor(host, report, cursor, onSelect) {
    this.isDive = report.dive !== null;
    this.times = this.isDive ? report.paths.map((path) => path.asked_s) : [];
    const times = this.isDive ? [['Asked at', 'number'], ['Answered after', 'number']] :
                                [['Computed in', 'number']];
    const columns = [
      ['No.', 'number'], ...times, ['State'], ['Goal'], ...(this.isDive ? [['Why']] : []),
      ['Result'], ['Length', 'number'], ['Certified', 'number'], ['Warm starts', 'number']
    ];
    this.rows = report.paths.map((path, index) => this.row(path, index, cursor, onSelect));
    const table = element(
        'table', {},
        element(
            'thead', {},
            element(
                'tr', {},
                ...columns.map(
                    ([name, kind = '']) => element('th', {scope: 'col', class: kind}, name)))),
        element('tbody', {}, ...this.rows));
    host.append(
        element('h2', {}, this.isDive ? 'Plans' : 'Legs'),
        element('div', {class: 'scroll'}, table));
    this.current = -1;
    if (this.isDive) cursor.subscribe((t) => this.mark(lastIndexAt(this.times, t + 1e-6)));
  }

  row(path, index, cursor, onSelect) {
    const select = () => {
      if (this.isDive)
        cursor.set(path.answered_s ?? path.asked_s);  // from when it may be followed
      else
        this.mark(index);
      onSelect(index);
    };
    const choose = element('button', {type: 'button', onclick: select}, String(path.id));
    const why = this.isDive ? [cell(path.cause + (path.is_replan ? ' (replan)' : ''))] : [];
    return element(
        'tr', {}, element('td', {class: 'number'}, choose), ...timesOf(path, this.isDive),
        cell(path.state), cell(path.goal), ...why,
        cell(statusOf(path), path.accepted ? '' : 'refused'),
        cell(number(path.length_m, 1, 'm'), 'number'),
        cell(number(path.clearance_m, 2, 'm'), 'number'), cell(String(path.warm_starts), 'number'));
  }

  mark(index) {
    if (index === this.current) return;
    this.rows[this.current]?.removeAttribute('aria-current');
    this.current = index;
    this.rows[index]?.setAttribute('aria-current', 'true');
  }

  shown() {
    return String(this.current);
  }
}
