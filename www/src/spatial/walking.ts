/** On foot through the map: at eye height, looking around. */
import { html, type TemplateResult } from 'lit';
import { axes, type Direction, type Orbit, orbited } from '../views/orbit.js';
import { added, transformed, turned, type Vec3 } from '../views/vectors.js';
import type { MapTool, ToolHost } from './map-tool.js';
import { positionOf } from './poses.js';
import { ahead } from './riding.js';

/** Eyes of a standing adult, m (ISO 7250-2: 1.5 to 1.65 in the mean of the populations). */
const EYE_HEIGHT = 1.6;
/** And below a low ceiling, m. */
const BELOW_CEILING = 0.15;
/** Comfortable walking, m/s (Bohannon, Age and Ageing 26, 1997); a run with Shift. */
const WALKING_SPEED = 1.4;
const RUNNING_FACTOR = 2.5;
/** rad/s: a quarter turn a second. */
const TURNING_SPEED = Math.PI / 2;
/** Of a key that is pressed by a program, and of a button that is clicked without being held: m, rad. */
const STEP = 0.4;
/** Half the height that is seen a metre away: 65 degrees, so that a room is seen in its width. */
const TAN_HALF_VIEW = Math.tan((32.5 * Math.PI) / 180);
/** Radians that a pixel of a drag turns. */
const TURN_PER_PIXEL = 0.004;
/** After a pause no leap follows, s. */
const LONGEST_STEP = 0.5;

type Move = 'forward' | 'backward' | 'left' | 'right' | 'turn_left' | 'turn_right' | 'up' | 'down';

const KEYS: Readonly<Record<string, Move>> = {
  w: 'forward',
  s: 'backward',
  a: 'left',
  d: 'right',
  e: 'up',
  q: 'down',
  ArrowUp: 'forward',
  ArrowDown: 'backward',
  ArrowLeft: 'turn_left',
  ArrowRight: 'turn_right',
};

const PAD: readonly (readonly [Move, string, string])[] = [
  ['turn_left', '↶', 'Turn left'],
  ['forward', '▲', 'Walk ahead'],
  ['turn_right', '↷', 'Turn right'],
  ['left', '◀', 'Step to the left'],
  ['backward', '▼', 'Walk back'],
  ['right', '▶', 'Step to the right'],
];

/** Where one stands, and where one looks. */
export interface Stand extends Direction {
  eye: Vec3;
}

/** The view of someone who stands there. */
export function viewOf({ eye, azimuth, elevation }: Stand): Orbit {
  const { back } = axes({ azimuth, elevation });
  const [distance, projection] = [1, 'perspective'] as const;
  return { target: added(eye, back, -distance), distance, azimuth, elevation, projection, tanHalfView: TAN_HALF_VIEW };
}

/** After so many metres or, of turns, radians: on the level, wherever one looks. */
export function moved(stand: Stand, move: Move, amount: number): Stand {
  const { right, up, back } = axes({ azimuth: stand.azimuth, elevation: 0 });
  const along = (direction: Vec3, by: number): Stand => ({ ...stand, eye: added(stand.eye, direction, by) });
  switch (move) {
    case 'forward':
      return along(back, -amount);
    case 'backward':
      return along(back, amount);
    case 'left':
      return along(right, -amount);
    case 'right':
      return along(right, amount);
    case 'up':
      return along(up, amount);
    case 'down':
      return along(up, -amount);
    case 'turn_left':
      return { ...stand, azimuth: stand.azimuth + amount };
    case 'turn_right':
      return { ...stand, azimuth: stand.azimuth - amount };
  }
}

/** At eye height where the camera of this frame, or of the first, stood; looking on the level where it looked. */
function firstStand({ marks, survey, orbit }: ToolHost): Stand {
  const { floor, top } = survey.heights;
  const height = Math.min(floor + EYE_HEIGHT, top - BELOW_CEILING);
  const pose = marks.poses[marks.selected ?? 0];
  if (!pose) return { eye: [orbit.target[0], height, orbit.target[2]], azimuth: orbit.azimuth, elevation: 0 };
  const inView = (v: Vec3): Vec3 => transformed(survey.R_view_map, v);
  const [x, , z] = inView(positionOf(pose));
  const [dx, , dz] = inView(turned(pose, ahead(marks.camera)));
  return { eye: [x, height, z], azimuth: Math.atan2(-dx, -dz), elevation: 0 };
}

export class Walking implements MapTool {
  readonly hidden = ['cameras'] as const;
  readonly isInside = true;
  readonly help =
    'W A S D walk, the arrow keys walk and turn, Q and E go down and up, Shift runs; a drag looks around, the wheel walks; Esc ends.';
  #host: ToolHost;
  #stand: Stand;
  #held = new Set<Move>();
  #isRunning = false;
  #last = 0;

  constructor(host: ToolHost) {
    this.#host = host;
    this.#stand = firstStand(host);
    this.#show();
  }

  advance(now: number): boolean {
    if (this.#held.size === 0) return false;
    const seconds = Math.min((now - this.#last) / 1000, LONGEST_STEP);
    this.#last = now;
    for (const move of this.#held) {
      const isTurn = move.startsWith('turn');
      const speed = isTurn ? TURNING_SPEED : WALKING_SPEED * (this.#isRunning ? RUNNING_FACTOR : 1);
      this.#stand = moved(this.#stand, move, speed * seconds);
    }
    this.#show();
    return true;
  }

  key(key: string, isShifted: boolean): boolean {
    const move = KEYS[key];
    if (!move) return false;
    this.#isRunning = isShifted;
    this.#hold(move);
    return true;
  }

  keyUp(key: string): void {
    const move = KEYS[key];
    if (move) this.#release(move);
    else if (key === '') this.#held.clear();
  }

  turn(right: number, down: number): boolean {
    // What is under the finger stays there.
    const turnedAway = orbited(this.#stand, -right * TURN_PER_PIXEL, down * TURN_PER_PIXEL, -Math.PI / 2);
    this.#stand = { ...this.#stand, ...turnedAway };
    this.#show();
    return true;
  }

  shift(right: number, down: number): boolean {
    // Two fingers push the floor.
    this.#step('right', -0.01 * right);
    this.#step('forward', 0.01 * down);
    return true;
  }

  zoom(factor: number): boolean {
    this.#step('forward', STEP * Math.log2(factor) * 2);
    return true;
  }

  renderBar(): unknown {
    return null;
  }

  renderOver(): TemplateResult {
    return html`<div class="pad" role="group" aria-label="Walk">
      ${PAD.map(
        ([move, sign, label]) =>
          html`<button
            type="button"
            aria-label=${label}
            @pointerdown=${(event: PointerEvent) => {
              (event.currentTarget as Element).setPointerCapture(event.pointerId);
              this.#isRunning = false;
              this.#hold(move);
            }}
            @pointerup=${() => this.#release(move)}
            @pointercancel=${() => this.#release(move)}
            @click=${({ detail }: MouseEvent) => {
              // From the keyboard or a screen reader, a click is a step.
              if (detail === 0) this.#step(move, move.startsWith('turn') ? Math.PI / 12 : STEP);
            }}
          >
            ${sign}
          </button>`,
      )}
    </div>`;
  }

  end(): void {
    this.#held.clear();
  }

  #hold(move: Move): void {
    if (this.#held.size === 0) this.#last = performance.now();
    this.#held.add(move);
    this.#host.requestPaint();
  }

  /** As long as the key was down, however long a picture took. */
  #release(move: Move): void {
    this.advance(performance.now());
    this.#held.delete(move);
  }

  #step(move: Move, amount: number): void {
    this.#stand = moved(this.#stand, move, amount);
    this.#show();
  }

  #show(): void {
    this.#host.move(viewOf(this.#stand));
  }
}
