/// <reference lib="esnext.disposable" preserve="true" />
/**
 * The custom element `<scanstitch-app>`: `import 'scanstitch/element'` defines it, and does nothing where there is no page to
 * define it for. Attributes, slots, parts and CSS variables: docs/embedding.md.
 */
import type { LocalizationResult, ReconstructionResult, SpatialResult } from '../pkg/scanstitch.js';
import type { Compared } from './report/strategy_table.js';

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
  /** Something went wrong, and is shown in the element. */
  'scanstitch-error': ScanstitchFault;
  /** A result of Evaluate is on the screen. `total_ms`: since the files were dropped or an option was changed. */
  'scanstitch-evaluated': { elapsed_ms: number; total_ms: number };
  /** Marks and projections of the bird's-eye view are on the screen. */
  'scanstitch-projected': { elapsed_ms: number };
  /** All scans of a recording are located in a map. `elapsed_ms`: since both were there. */
  'scanstitch-located': Pick<LocalizationResult, 'verdict' | 'summary' | 'num_scans_to_find'> & { elapsed_ms: number };
  /** A comparison of strategies is on the screen. */
  'scanstitch-compared': readonly { name: string; label: string; result: Compared }[];
}

/** The attributes as properties: they may be set in any order, before or after the element is defined and put on the page. */
export interface ScanstitchAttributes {
  /** What to open: addresses of files, separated by spaces or as a JSON list; one manifest; or `sample`. Empty: nothing. */
  src: string;
  /** `name=value&name=value`, in metres and radians. */
  settings: string;
  /** The name of a preset. */
  preset: string;
  /** What is shown first. */
  view: 'map' | 'localize' | 'icp' | 'bev' | 'evaluate' | 'strategies' | 'live';
  /** Colours; `auto`: those of the system. */
  theme: 'auto' | 'light' | 'dark';
  /** What stands around the map: nothing; its buttons, the slider and the figures in a line; or header and panels as well. */
  controls: 'none' | 'minimal' | 'full';
  /** With the view `localize`: the address of the map, map.yaml or `wean.dat`. */
  map: string;
  /** With the view `icp` and without `src`: a scene of its gallery, such as `corridor`. */
  scene: string;
  /** The address of a robot's bridge, such as `ws://localhost:8765`: it is connected to at once, and its topics are mapped as they come. */
  live: string;
  /** Whether the page is kept for use without a network; or the address of the service worker that does so. */
  offline: boolean | string;
  /** Whether changed settings are kept in the address of the page. The attribute is `remember-settings`. */
  rememberSettings: boolean;
}

export interface ScanstitchElement extends HTMLElement, ScanstitchAttributes {
  /**
   * Opens other files in place of what is open: what `src` may hold, addresses, or files of this machine, as a drop would.
   * Fulfilled when the computation has begun; rejected where nothing could be opened, with an AbortError where something else was
   * asked for meanwhile.
   */
  open(source: string | readonly string[] | Iterable<File>): Promise<void>;
  /** Computes what is open, or goes on after `cancel`, and waits for the end; what is done already is not computed again. */
  run(): Promise<ScanstitchResult>;
  /** Stops fetching and computing. What has been computed stays on the screen. */
  cancel(): void;
  /** What was computed; null before the first computation is done, and while another one is under way. */
  readonly result: ScanstitchResult | null;
  /** The points of what has been computed so far; null where there are none. */
  readonly map_points: ScanstitchMapPoints | null;
}

type EventMap = { [K in keyof ScanstitchEvents]: CustomEvent<ScanstitchEvents[K]> };
/** As React names them: `onscanstitch-done`. */
type Handlers = { [K in keyof EventMap as `on${K}`]?: (event: EventMap[K]) => void };
/** What JSX and templates may set, beside what every element has. */
type Settable = Partial<ScanstitchAttributes> & { 'remember-settings'?: boolean };

declare global {
  interface HTMLElementTagNameMap {
    'scanstitch-app': ScanstitchElement;
  }
  /** Of elements, of the document and of the window. */
  interface GlobalEventHandlersEventMap extends EventMap {}
}

// React and Vue need not be installed: what is ignored below is that they are not found.

/** @ts-ignore */
declare module 'react' {
  namespace JSX {
    interface IntrinsicElements {
      /** @ts-ignore */
      'scanstitch-app': DetailedHTMLProps<HTMLAttributes<ScanstitchElement>, ScanstitchElement> & Settable & Handlers;
    }
  }
}

/** @ts-ignore */
declare module 'vue' {
  interface GlobalComponents {
    'scanstitch-app': new () => ScanstitchElement & {
      /** @ts-ignore */
      $props: import('vue').HTMLAttributes & import('vue').PublicProps & Settable;
      /** @ts-ignore */
      $emit: import('vue').EmitFn<{ [K in keyof EventMap]: (event: EventMap[K]) => void }>;
    };
  }
}
