/** The evaluation's thread: reads trajectories, keeps them, compares them. The only module here that imports the engine. */
import init, { evaluate, Trajectory } from '../../../pkg/scanstitch.js';
import type {
  Answer,
  Comparison,
  EvaluationOptions,
  FromWorker,
  Question,
  ToWorker,
  TrajectoryFile,
} from './protocol.js';

/** Trajectories by their file: the same file is read once, whatever is asked of it. */
const known = new Map<number, Trajectory>();

self.onmessage = ({ data }: MessageEvent<ToWorker>): void => {
  handle(data).catch((error: unknown) => {
    post({ type: 'crashed', message: error instanceof Error ? error.message : String(error) });
  });
};

async function handle(message: ToWorker): Promise<void> {
  if (message.type === 'start') {
    await init({ module_or_path: message.module });
    post({ type: 'ready' });
    return;
  }
  const answer = compareAll(message.question);
  const buffers = answer.comparisons.flatMap((comparison) =>
    Object.values(comparison).flatMap((value) => (ArrayBuffer.isView(value) ? [value.buffer as ArrayBuffer] : [])),
  );
  post({ type: 'answer', answer }, buffers);
}

function compareAll({ id, reference, estimates, options }: Question): Answer {
  const start = performance.now();
  const answer: Answer = { id, comparisons: [], refusals: [], reference_problem: null, elapsed_ms: 0 };
  forgetAllBut([reference, ...estimates]);
  const truth = attempt(() => read(reference));
  if ('problem' in truth) {
    answer.reference_problem = truth.problem;
    return answer;
  }
  for (const file of estimates) {
    const compared = attempt(() => compare(truth.value, file, options));
    if ('problem' in compared) answer.refusals.push({ id: file.id, name: file.name, problem: compared.problem });
    else answer.comparisons.push(compared.value);
  }
  answer.elapsed_ms = performance.now() - start;
  return answer;
}

function compare(truth: Trajectory, file: TrajectoryFile, options: Partial<EvaluationOptions>): Comparison {
  const estimate = read(file);
  const evaluation = evaluate(truth, estimate, options);
  try {
    const summary = evaluation.summary();
    return {
      id: file.id,
      name: file.name,
      summary: { ...summary, notes: [...estimate.notes, ...summary.notes] },
      errors: evaluation.errors(),
      error_poses: evaluation.error_poses(),
      stamps: evaluation.stamps() ?? null,
      distances: evaluation.distances(),
      reference_positions: evaluation.reference_positions(),
      estimate_positions: evaluation.estimate_positions(),
      reference_angles: evaluation.reference_roll_pitch_yaw() ?? null,
      estimate_angles: evaluation.estimate_roll_pitch_yaw() ?? null,
    };
  } finally {
    evaluation.free();
  }
}

function read({ id, name, bytes }: TrajectoryFile): Trajectory {
  const found = known.get(id);
  if (found) return found;
  const trajectory = Trajectory.read(bytes, name);
  known.set(id, trajectory);
  return trajectory;
}

function forgetAllBut(files: readonly TrajectoryFile[]): void {
  const wanted = new Set(files.map(({ id }) => id));
  for (const [id, trajectory] of known) {
    if (wanted.has(id)) continue;
    trajectory.free();
    known.delete(id);
  }
}

/** The value, or what is wrong with the input; a defect of the engine goes on up. */
function attempt<T>(action: () => T): { value: T } | { problem: string } {
  try {
    return { value: action() };
  } catch (error) {
    if (error instanceof Error && error.name === 'ScanstitchError') return { problem: error.message };
    throw error;
  }
}

function post(message: FromWorker, transfer: Transferable[] = []): void {
  self.postMessage(message, { transfer });
}
