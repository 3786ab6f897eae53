/// <reference lib="esnext.disposable" />
/**
 * The custom element `<scanstitch-app>`: `import 'scanstitch/element'` defines it. Attributes, slots, parts and CSS variables:
 * docs/embedding.md.
 */
import type { ReconstructionResult, SpatialResult } from '../pkg/scanstitch.js';

/** Milliseconds of computing. */
export interface ScanstitchTiming {
  total: number;
  /** One for each frame. */
  frames: readonly number[];
}

/** What was computed: of laser scans in the plane, or of depth images and clouds in space. */
export type ScanstitchResult =
  | { kind: 'planar'; result: ReconstructionResult; timing: ScanstitchTiming }
  | { kind: 'spatial'; result: SpatialResult; timing: ScanstitchTiming };

/** The points of the stitched map, in the world frame. */
export interface ScanstitchMapPoints {
  dimensions: 2 | 3;
  /** x y x y ... or x y z x y z ... (m). */
  positions: Float32Array;
  /** red green blue ..., 0 to 255; empty without colours. */
  colors: Uint8Array;
}

export interface ScanstitchProgress {
  stage: 'fetching' | 'reading' | 'running';
  /** Share of the stage that is done, 0 to 1. */
  progress: number;
  /** The same in words. */
  activity: string;
}

/** What went wrong, as it is shown in the element. */
export interface ScanstitchFault {
  /** The file it is about; empty for none. */
  file: string;
  /** "line 12", "byte 4096", or empty. */
  place: string;
  message: string;
  /** What to do; empty where nothing can be done. */
  remedy: string;
}

/** Events of the element and their details. All bubble and leave shadow trees. */
export interface ScanstitchEvents {
  /** While files are fetched and read and frames are registered. */
  'scanstitch-progress': ScanstitchProgress;
  /** A computation is over and, where the element is shown, its map is on the screen. `elapsed_ms`: since the files were given or a setting was changed. */
  'scanstitch-done': ScanstitchResult & { elapsed_ms: number };
  'scanstitch-error': ScanstitchFault;
}

export interface ScanstitchElement extends HTMLElement {
  /** As the attributes of these names. */
  src: string;
  settings: string;
  preset: string;
  theme: 'auto' | 'light' | 'dark';
  /**
   * Opens other files in place of what is open: what `src` may hold, addresses, or files of this machine, as a drop would.
   * Fulfilled when the computation has begun; rejected where nothing could be opened.
   */
  open(source: string | readonly string[] | Iterable<File>): Promise<void>;
  /** Computes what is open, or goes on after `cancel`, and waits for the end; what is done already is not computed again. */
  run(): Promise<ScanstitchResult>;
  /** Stops fetching and computing. What has been computed stays on the screen. */
  cancel(): void;
  /** Null before the first computation is done, and while another one is under way. */
  readonly result: ScanstitchResult | null;
  /** The map of what has been computed so far; null where there is none. */
  readonly map_points: ScanstitchMapPoints | null;
}

declare global {
  interface HTMLElementTagNameMap {
    'scanstitch-app': ScanstitchElement;
  }
  /** Of elements, of the document and of the window. */
  interface GlobalEventHandlersEventMap {
    'scanstitch-progress': CustomEvent<ScanstitchEvents['scanstitch-progress']>;
    'scanstitch-done': CustomEvent<ScanstitchEvents['scanstitch-done']>;
    'scanstitch-error': CustomEvent<ScanstitchEvents['scanstitch-error']>;
  }
}
