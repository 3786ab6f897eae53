/** The tools of the page: the map of a run, and the views beside it. */

/** Views of a run, and views beside it. */
export type Run = 'planar' | 'spatial';
export type View = Run | 'evaluation' | 'bev' | 'strategies' | 'icp' | 'localize' | 'live';
/** What the header offers: the map of the run, or a view beside it. */
export type Tool = 'map' | Exclude<View, Run>;

/** `short` stands where there is little room. */
export const TOOLS: readonly { tool: Tool; label: string; short?: string; about: string }[] = [
  { tool: 'map', label: 'Map', about: 'Path and map of a recording' },
  { tool: 'localize', label: 'Localize', about: 'Find a recording in a map that you have' },
  { tool: 'icp', label: 'ICP', about: 'Step through a registration, from any start, by any method' },
  { tool: 'evaluation', label: 'Evaluate', about: 'Compare trajectories with ground truth' },
  { tool: 'bev', label: "Bird's-eye view", short: 'BEV', about: 'Project points of a top view into a front view' },
  { tool: 'strategies', label: 'Strategies', about: 'Ways to keep a map: memory, time, accuracy' },
];
