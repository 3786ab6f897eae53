/** The certain pieces of a map: which there are, their colours, and which links of the path are not certain. */
import type { Status } from './map-painter.js';
import { grey, hueColor, type Rgb } from './palette.js';

/** A certain piece of the map, or all small ones together. */
export interface Piece {
  /** What the legend calls it: numbered by size, without a gap. */
  label: string;
  /** What exported files call it; empty for small ones together. */
  exported: string;
  /** How many pieces stand behind it: one, or all small ones. */
  numPieces: number;
  /** Frames in it, in ascending order. */
  frames: readonly number[];
  color: Rgb;
}

interface Frame {
  piece: number;
  status: Status;
}

/** Hues that most people can distinguish, degrees; the largest piece has the first. */
const HUES = [262, 62, 152, 310, 205, 100];
/** Pieces of fewer frames than this are shown together. */
const MIN_FRAMES = 5;

/**
 * The largest pieces from the largest on, among them the one that the engine calls the main one, then all small ones; empty where
 * the map is one piece.
 */
export function certainPieces(frames: readonly Frame[], dark: boolean): Piece[] {
  const ofPiece = new Map<number, number[]>();
  frames.forEach(({ piece, status }, frame) => {
    if (status === 'lost') return;
    const known = ofPiece.get(piece);
    if (known) known.push(frame);
    else ofPiece.set(piece, [frame]);
  });
  if (ofPiece.size < 2) return [];
  const bySize = [...ofPiece].sort(([, p], [, q]) => q.length - p.length);
  const isShown = ([piece, members]: [number, number[]], rank: number): boolean =>
    piece === 0 || (rank < HUES.length - 1 && members.length >= MIN_FRAMES);
  const shown = bySize.filter(isShown);
  const others = bySize.filter((piece, rank) => !isShown(piece, rank));
  const pieces = shown.map(([piece, members], rank) => ({
    label: rank === 0 ? 'Main piece' : piece === 0 ? 'Piece of the first scan' : `Piece ${rank + 1}`,
    exported: piece === 0 ? 'map' : `map_piece_${piece}`,
    numPieces: 1,
    frames: members,
    color: hueColor(HUES[rank] ?? 0, dark),
  }));
  if (others.length === 0) return pieces;
  const rest = others.flatMap(([, members]) => members).sort((a, b) => a - b);
  const label = others.length === 1 ? '1 small piece' : `${others.length} small pieces`;
  return [...pieces, { label, exported: '', numPieces: others.length, frames: rest, color: grey(dark) }];
}

/** The colour of each frame's piece; a lost frame has that of the small pieces. */
export function pieceColors(pieces: readonly Piece[], num_frames: number, dark: boolean): Rgb[] {
  const colors = new Array<Rgb>(num_frames).fill(grey(dark));
  for (const { frames, color } of pieces) for (const frame of frames) colors[frame] = color;
  return colors;
}

/**
 * For each frame whether its link to the frame before is uncertain: it leads to another piece, to or from a lost frame, or to
 * a doubtful frame of the main piece. In the other pieces every frame is doubtful, but not its link to the one before.
 */
export function uncertainLinks(frames: readonly Frame[]): boolean[] {
  return frames.map(({ piece, status }, i) => {
    const before = frames[i - 1];
    if (!before) return false;
    const isLost = status === 'lost' || before.status === 'lost';
    return isLost || piece !== before.piece || (piece === 0 && status === 'doubtful');
  });
}
