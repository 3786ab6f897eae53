/** A file of the engine that a script holds as text (vite.element.ts). */
export function unpacked(packed: string): Response {
  const bytes = Uint8Array.from(atob(packed), (character) => character.charCodeAt(0));
  const module = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('gzip'));
  return new Response(module, { headers: { 'Content-Type': 'application/wasm' } });
}
