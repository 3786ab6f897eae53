/** What keys mean on the stage, in the plane and in space alike. */

export type RunKey = 'next' | 'previous' | 'play' | 'run' | 'first' | 'last';

export interface StageKeys {
  /** The source, to the right and down on the screen. */
  shift(right: number, down: number): void;
  /** Counter-clockwise: 1. */
  turn(direction: 1 | -1): void;
  zoom(direction: 1 | -1): void;
  fit(): void;
  pan(right: number, down: number): void;
  tell(key: RunKey): void;
}

const ARROWS: Record<string, readonly [right: number, down: number]> = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, -1],
  ArrowDown: [0, 1],
};

export function pressStageKey(event: KeyboardEvent, keys: StageKeys): void {
  if (event.metaKey || event.altKey) return;
  const arrow = ARROWS[event.key];
  const actions: Record<string, () => void> = {
    '[': () => keys.turn(1),
    '{': () => keys.turn(1),
    ']': () => keys.turn(-1),
    '}': () => keys.turn(-1),
    '+': () => keys.zoom(1),
    '=': () => keys.zoom(1),
    '-': () => keys.zoom(-1),
    f: () => keys.fit(),
    '.': () => keys.tell('next'),
    ',': () => keys.tell('previous'),
    ' ': () => keys.tell('play'),
    Enter: () => keys.tell('run'),
    Home: () => keys.tell('first'),
    End: () => keys.tell('last'),
  };
  const action = arrow
    ? () => (event.ctrlKey ? keys.pan(...arrow) : keys.shift(...arrow))
    : event.ctrlKey
      ? undefined
      : actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
  if (!action) return;
  event.preventDefault();
  action();
}
