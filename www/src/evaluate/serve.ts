/** The worker's side of it: starts the engine, takes messages, answers questions. */
import init from '../../../pkg/scanstitch.js';
import type { FromWorker, ToWorker } from './protocol.js';

export function serve<Told, Asked, Given>(
  remember: (told: Told) => void,
  answer: (question: Asked) => { answer: Given; transfer: Transferable[] },
): void {
  const post = (message: FromWorker<Given>, transfer: Transferable[] = []): void => {
    self.postMessage(message, { transfer });
  };
  const handle = async (message: ToWorker<Told, Asked>): Promise<void> => {
    if (message.type === 'start') {
      await init({ module_or_path: message.module });
      post({ type: 'ready' });
    } else if (message.type === 'tell') {
      remember(message.told);
    } else {
      const found = answer(message.question);
      post({ type: 'answer', id: message.id, answer: found.answer }, found.transfer);
    }
  };
  self.onmessage = ({ data }: MessageEvent<ToWorker<Told, Asked>>): void => {
    handle(data).catch((error: unknown) => {
      post({ type: 'crashed', message: error instanceof Error ? error.message : String(error) });
    });
  };
}

/** The value, or what is wrong with the input; a defect of the engine goes on up. */
export function attempt<T>(action: () => T): { value: T } | { problem: string } {
  try {
    return { value: action() };
  } catch (error) {
    if (error instanceof Error && error.name === 'ScanstitchError') return { problem: error.message };
    throw error;
  }
}
