/** What a run in space rests on that its recording does not confirm, in words: for the page, the command line and the report. */
import type { SpatialResult } from '../../pkg/scanstitch.js';

type Assumption = SpatialResult['assumptions'][number];

/** The assumptions that neither the data nor a ground truth confirms. */
export function unconfirmed(assumptions: readonly Assumption[]) {
  return assumptions.filter(({ confirmed_by }) => confirmed_by === null);
}

/**
 * "if the depth scale is 1000 raw values per metre, which nothing in the recording confirms": what is to follow a
 * number of good frames;
 * empty where nothing is left unconfirmed and the depth images do not contradict the scale.
 */
export function condition({ assumptions, is_scale_contradicted, depth_scale }: SpatialResult) {
  const open = unconfirmed(assumptions).map(({ setting, value }) => premise(setting, value));
  const parts = [
    is_scale_contradicted ? `${premise('depth_scale', depth_scale ?? NaN)}, which the depth images contradict` : '',
    open.length > 0 ? `${open.join(' and ')}, which nothing in the recording confirms` : '',
  ].filter((part) => part !== '');
  return parts.length > 0 ? `if ${parts.join(', and if ')}` : '';
}

function premise(setting: Assumption['setting'], value: number) {
  if (setting === 'cloud_unit') return `a unit of the clouds' coordinates is ${Number(value.toPrecision(4))} m`;
  return setting === 'depth_scale'
    ? `the depth scale is ${Number(value.toPrecision(6))} raw values per metre`
    : `the focal length is ${Number(value.toPrecision(4))} pixels`;
}

/**
 * " (assumed)" behind a value that was, " (assumed; supported by ...)" with what confirms it, nothing behind one that was given.
 */
export function assumedMark(assumptions: readonly Assumption[], wanted: Assumption['setting']) {
  const assumption = assumptions.find(({ setting }) => setting === wanted);
  if (!assumption) return '';
  const [support] = assumption.confirmed_by?.split(',') ?? [];
  return support === undefined ? ' (assumed)' : ` (assumed; supported by ${support})`;
}

/**
 * A run's frames by status, with what the good ones rest on: "118 good if ...; 2 doubtful, 0 lost".
 * @param remedy how to change it
 */
export function statusWords(result: SpatialResult, remedy = '') {
  const count = (status: string) => result.frames.filter((frame) => frame.status === status).length;
  const [good, doubtful, lost] = ['good', 'doubtful', 'lost'].map(count);
  const words = good === 0 ? '' : condition(result);
  const conditional = words === '' ? `${good} good,` : `${good} good ${words}${remedy};`;
  return `${conditional} ${doubtful} doubtful, ${lost} lost`;
}
