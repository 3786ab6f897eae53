/** What every canvas of the page needs: its context, and its picture as a file. */

/** Throws where the browser draws no canvas. */
export function context2d(canvas: HTMLCanvasElement): CanvasRenderingContext2D {
  const context = canvas.getContext('2d');
  if (!context) throw new Error('This browser draws no canvas.');
  return context;
}

/** As a PNG. The drawing of a graphics card is only there until the browser has shown it: call within the same task. */
export async function pngOf(canvas: HTMLCanvasElement): Promise<Blob> {
  const blob = await new Promise<Blob | null>((resolve) => canvas.toBlob(resolve));
  if (!blob) throw new Error('The browser could not make the picture.');
  return blob;
}
