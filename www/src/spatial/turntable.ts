/** The map as it turns once, as a video (WebM). Loaded on demand. */

/** A turn takes so long, s: 45 degrees a second. */
const SECONDS = 8;
const FRAMES_A_SECOND = 30;
/** The first that the browser has. */
const FORMATS = ['video/webm;codecs=vp9', 'video/webm;codecs=vp8', 'video/webm'];
/** Bits a second: a picture of a million pixels with fine texture. */
const BITS_A_SECOND = 12e6;

/** Records what is on the canvas while `show` draws it at every share of the turn, 0 to 1. */
export async function recordTurn(canvas: HTMLCanvasElement, show: (share: number) => void): Promise<Blob> {
  const mimeType = globalThis.MediaRecorder && FORMATS.find((format) => MediaRecorder.isTypeSupported(format));
  if (!mimeType) throw new Error('This browser does not record WebM videos');
  const stream = canvas.captureStream(FRAMES_A_SECOND);
  const recorder = new MediaRecorder(stream, { mimeType, videoBitsPerSecond: BITS_A_SECOND });
  const parts: Blob[] = [];
  const end = new Promise<void>((resolve, reject) => {
    recorder.addEventListener('dataavailable', ({ data }) => parts.push(data));
    recorder.addEventListener('stop', () => resolve());
    recorder.addEventListener('error', () => reject(new Error('The browser stopped recording')));
  });
  recorder.start();
  try {
    const start = performance.now();
    for (let share = 0; share < 1; share = (performance.now() - start) / 1000 / SECONDS) {
      show(share);
      await new Promise((resolve) => requestAnimationFrame(resolve));
    }
  } finally {
    recorder.stop();
    for (const track of stream.getTracks()) track.stop();
  }
  await end;
  return new Blob(parts, { type: 'video/webm' });
}
