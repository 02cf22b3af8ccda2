// The result in words, above everything else.

import {isKnown} from './data.js';
import {breakable, clock, counted, element, number} from './format.js';

const HEADLINES = {
  success: ['good', 'Success'],
  aborted: ['warn', 'Aborted'],
  held: ['warn', 'Held in place'],
  failure: ['bad', 'Failure'],
};

function fact(name, value, ...note) {
  return element(
      'div', {}, element('dt', {}, name),
      element('dd', {}, value, note.length ? element('small', {}, ...note) : null));
}

function timeButton(cursor, t) {
  return element(
      'button', {type: 'button', onclick: () => cursor.set(t), title: 'Move the cursor there'},
      'at ' + clock(t));
}

function withButton(text, cursor, t) {
  return element('span', {}, text + ' ', timeButton(cursor, t));
}

function collisionsFact(verdict, cursor) {
  if (!verdict.has_truth) return fact('Collisions', 'not known', 'the log has no ground truth');
  if (verdict.collisions.length === 0) return fact('Collisions', 'none');
  const first = verdict.collisions[0];
  return fact(
      'Collisions', withButton(String(verdict.collisions.length), cursor, first.t),
      'the first with ', breakable(first.obstacle));
}

function clearanceFact(report, cursor) {
  const {nearest, has_truth: hasTruth} = report.dive.verdict;
  if (!hasTruth) return fact('Least clearance', 'not known', 'the log has no ground truth');
  if (nearest === null) return fact('Least clearance', 'no obstacle');
  return fact(
      'Least clearance', withButton(number(nearest.clearance_m, 2, 'm'), cursor, nearest.t), 'to ',
      breakable(nearest.obstacle), `; required ${number(report.clearance_required_m, 2, 'm')}`);
}

function diveFacts(report, cursor) {
  const {verdict} = report.dive;
  const error = verdict.has_truth ? number(verdict.final_error_m, 2, 'm') : 'not known';
  const source = verdict.has_truth ? 'by ground truth' : 'as estimated';
  return [
    fact('Duration', clock(verdict.duration_s), `${number(verdict.duration_s, 2, 's')}`),
    fact('Distance swum', number(verdict.distance_m, 1, 'm'), source),
    clearanceFact(report, cursor),
    collisionsFact(verdict, cursor),
    fact(
        'Final position error', error,
        `one sigma of the estimate ${number(verdict.final_sigma_m, 2, 'm')}`),
    fact('Plans', counted(verdict.plans, 'plan'), counted(verdict.replans, 'replan')),
  ];
}

/** How the mission was checked before the dive (LogHeader::check). */
function checkOf(check) {
  if (check === '') return element('span', {}, 'mission file, not a verified bundle');
  if (check === 'unchecked') return element('span', {}, 'unchecked: dived with --unchecked');
  const [, hash, unchecked] = /^bundle ([0-9a-f]+)(, unchecked)?$/.exec(check) ?? [];
  if (!hash) return element('span', {}, `check: ${check}`);
  return element(
      'span', {title: `BLAKE2b-256 ${hash}`},
      unchecked ? 'bundle, dived with --unchecked ' : 'verified bundle ',
      element('code', {}, hash.slice(0, 12)));
}

function madeOf(report) {
  const dived = report.dived_by && report.dived_by !== report.made_by ?
      `, dived with dive ${report.dived_by}` :
      '';
  return element(
      'p', {class: 'made'},
      ...report.files.map(
          (file) => element(
              'span', {title: `SHA-256 ${file.sha256}`}, `${file.role} ${file.name} `,
              element('code', {}, file.sha256.slice(0, 12)))),
      ...(report.dive ? [checkOf(report.check)] : []), element('span', {}, `seed ${report.seed}`),
      element('span', {}, `report by dive ${report.made_by}${dived}`));
}

function notices(report) {
  const dive = report.dive;
  const list = [];
  if (dive === null) {
    if (report.map_is_simulated) {
      list.push(
          'The vehicle has no map of this environment: the plan is that of the simulated world.');
    }
    return list;
  }
  if (dive.torn) list.push('The log ends within a tick: what came after it is not known.');
  if (dive.resumed)
    list.push('This dive continued an earlier one, whose log has what came before.');
  for (const gap of dive.gaps) {
    const until = gap.to_s === null ? 'the end' : clock(gap.to_s);
    list.push(`The log is damaged: nothing is known from ${clock(gap.from_s)} to ${until}.`);
  }
  if (!dive.verdict.has_truth) {
    list.push(
        'The log has no ground truth, as that of a real vehicle: collisions, true clearance and ' +
        'position error are not known. Clearances shown are those of the estimated pose.');
  }
  if (dive.rerun_problem) {
    list.push(`Exit path, trail and overhead are known until ${clock(dive.rerun_until_s)} only: ${
        dive.rerun_problem}.`);
  }
  if (report.map_is_simulated && dive.verdict.has_truth) {
    list.push('The vehicle had no map: what is shown as the map is the world of the simulation.');
  }
  return list;
}

function diveHeadline(report) {
  const {verdict} = report.dive;
  const [level, word] = HEADLINES[verdict.outcome] ?? ['warn', verdict.outcome];
  const sentence = verdict.cause ? verdict.cause[0].toUpperCase() + verdict.cause.slice(1) :
                                   'The mission ended as planned';
  return [
    level, `${word}: ${report.mission} ended in state ${verdict.final_state}`, sentence + '.'
  ];
}

function planHeadline(report) {
  const legs = report.paths;
  const refused = legs.filter((leg) => !leg.accepted);
  const length = legs.reduce((sum, leg) => sum + leg.length_m, 0);
  const level = refused.length ? 'bad' : 'good';
  const word = refused.length ?
      `No accepted path on ${counted(refused.length, 'leg')} of ${legs.length}` :
      `${counted(legs.length, 'leg')} planned`;
  const what = refused.length ?
      refused.map((leg) => `${leg.goal}: ${leg.reason || leg.status}`).join('; ') :
      `${number(length, 1, 'm')} of path, all certified`;
  return [level, `${report.mission}: ${word}`, what + '.'];
}

function planFacts(report) {
  const legs = report.paths.filter((leg) => leg.accepted);
  const length = legs.reduce((sum, leg) => sum + leg.length_m, 0);
  const tightest =
      legs.length ? legs.reduce((a, b) => (b.clearance_m < a.clearance_m ? b : a)) : null;
  return [
    fact(
        'Length', number(length, 1, 'm'),
        isKnown(report.speed_mps) ?
            `${clock(length / report.speed_mps, 0)} at ${number(report.speed_mps, 2, 'm/s')}` :
            ''),
    fact(
        'Least certified clearance', tightest ? number(tightest.clearance_m, 2, 'm') : 'not known',
        tightest ? `on the leg to ${tightest.goal}; required ${
                       number(report.clearance_required_m, 2, 'm')}` :
                   ''),
  ];
}

export function showVerdict(host, report, cursor) {
  const [level, headline, sentence] = report.dive ? diveHeadline(report) : planHeadline(report);
  const facts = report.dive ? diveFacts(report, cursor) : planFacts(report);
  host.replaceChildren(
      ...[element(
              'div', {class: `outcome ${level}`}, element('h1', {}, headline),
              element('p', {}, sentence)),
          ...notices(report).map((notice) => element('p', {class: 'notice', role: 'note'}, notice)),
          element('dl', {}, ...facts),
          report.description ? element('p', {class: 'made'}, report.description) : null,
          madeOf(report)]
          .filter(Boolean));
}
