/// <reference types="vite/client" />
/** On the page of `npm start` alone: how far the full engine is, while it is being compiled. */

/** What the server tells (scripts/full_engine.mjs). `progress`: what is being compiled, how far and for how long. */
export interface EngineStatus {
  state: 'compiling' | 'there' | 'failed';
  progress: string;
}

/** How long the page says that the engine is there (ms). */
const SHOWN_MS = 8000;

const strip = document.createElement('p');
strip.setAttribute('role', 'status');
strip.style.cssText = `position: fixed; z-index: 9; inset: auto 0 0; margin: 0; padding: 0.4em 1em; text-align: center;
  font: 14px/1.4 system-ui, sans-serif; color: light-dark(#1b2430, #e6ebf2); background: light-dark(#e3ebfb, #1b2a47)`;
const sentence = document.createElement('span');
/** Changes every second, which nobody wants to hear. */
const progress = document.createElement('span');
progress.ariaHidden = 'true';
strip.append(sentence, ' ', progress);

/** What can be done now, and what has to wait. */
const SENTENCES: Record<EngineStatus['state'], string> = {
  compiling: 'Planar PLY scans work now. For everything else the full engine is being compiled.',
  there: 'The full engine is ready: depth images, clouds, bags, logs and all tools.',
  failed: 'The full engine could not be compiled: the terminal says why. Planar PLY scans work.',
};

function show(status: EngineStatus): void {
  if (sentence.textContent !== SENTENCES[status.state]) sentence.textContent = SENTENCES[status.state];
  progress.textContent = status.progress;
  if (status.state !== 'there') document.body.append(strip);
  else setTimeout(() => strip.remove(), SHOWN_MS);
}

import.meta.hot?.on('scanstitch:engine', show);
import.meta.hot?.send('scanstitch:engine?');
