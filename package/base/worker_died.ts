/** A worker that has ended without an answer. */
export class WorkerDied extends Error {
  override name = 'WorkerDied';
  /** Whether the frame only waited for its turn: it is not to blame. */
  wasWaiting;

  constructor(message: string, wasWaiting = false) {
    super(message);
    this.wasWaiting = wasWaiting;
  }
}
