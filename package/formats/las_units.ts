/**
 * The unit of a LAS cloud, by the records of its coordinate system: keys of GeoTIFF, or OGC's text.
 *
 * Sources: ASPRS, "LAS Specification 1.4 - R15", tables 5, 20 and 21; OGC GeoTIFF 1.1 (19-008r4), annex B; ISO 19162.
 */
import { fileError } from '../base/errors.js';
import { latin1 } from '../files/heads.js';

const RECORD_HEADER_BYTES = 54;
const [KEYS_RECORD, TEXT_RECORD] = [34_735, 2112];
/** GeoTIFF's keys of the kind of system and of the units along the ground and upwards. */
const [MODEL_KEY, LINEAR_KEY, VERTICAL_KEY] = [1024, 3076, 4099];
const GEOGRAPHIC_MODEL = 2;
/** Metres of EPSG's units of length: metre, foot, US survey foot. */
const METRES: Readonly<Record<number, number>> = { 9001: 1, 9002: 0.3048, 9003: 1200 / 3937 };

/**
 * Metres of a unit along x, y and z; 1 where the file does not say.
 * @param name for messages
 * @param bytes of the file, its records of variable length at least
 * @returns throws a ScanstitchError where the coordinates are degrees
 */
export function metresOfLas(name: string, bytes: Uint8Array): [number, number, number] {
  const records = recordsOf(bytes);
  const text = records.get(TEXT_RECORD);
  const keys = records.get(KEYS_RECORD);
  const { isGeographic, ground, up } = text ? ofText(latin1(text)) : ofKeys(keys ?? new Uint8Array());
  if (isGeographic) {
    const problem = 'Its header says that its coordinates are longitude and latitude (degrees)';
    throw fileError(name, problem, 'Project it into metres, for example to UTM');
  }
  return [ground, ground, up ?? ground];
}

/** The records of the coordinate system, by their number. */
function recordsOf(bytes: Uint8Array) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const found = new Map<number, Uint8Array>();
  let at = view.getUint16(94, true);
  for (let left = view.getUint32(100, true); left > 0 && at + RECORD_HEADER_BYTES <= bytes.length; left -= 1) {
    const [id, length] = [view.getUint16(at + 18, true), view.getUint16(at + 20, true)];
    const begin = at + RECORD_HEADER_BYTES;
    const isOfSystem = latin1(bytes.subarray(at + 2, at + 18)).startsWith('LASF_Projection');
    if (isOfSystem && begin + length <= bytes.length) found.set(id, bytes.subarray(begin, begin + length));
    at = begin + length;
  }
  return found;
}

type Units = { isGeographic: boolean; ground: number; up?: number };

/** Of four numbers a key: its own, where its value stands (0: here), how many there are, and the value. */
function ofKeys(record: Uint8Array): Units {
  const view = new DataView(record.buffer, record.byteOffset, record.byteLength);
  const keys = new Map<number, number>();
  for (let at = 8; at + 8 <= record.length; at += 8) {
    if (view.getUint16(at + 2, true) === 0) keys.set(view.getUint16(at, true), view.getUint16(at + 6, true));
  }
  const unit = (key: number) => METRES[keys.get(key) ?? 0];
  const up = unit(VERTICAL_KEY);
  return {
    isGeographic: keys.get(MODEL_KEY) === GEOGRAPHIC_MODEL,
    ground: unit(LINEAR_KEY) ?? 1,
    ...(up !== undefined && { up }),
  };
}

/** `PROJCS[..., UNIT["US survey foot",0.304800609601219]]`, and `VERT_CS[...]` behind it. */
function ofText(text: string): Units {
  const [ground, up] = [/PROJ(?:CS|CRS)/, /VERT_?(?:CS|CRS)/].map((head) => {
    const begin = text.search(head);
    const units = begin < 0 ? [] : [...text.slice(begin).matchAll(/UNIT\[\s*"([^"]*)"\s*,\s*([\d.eE+-]+)/g)];
    const length = units.find(([, name = '']) => /f(oo|ee)t|met(re|er)/i.test(name));
    return length && Number(length[2]) > 0 ? Number(length[2]) : undefined;
  });
  const isProjected = /PROJ(CS|CRS)|LOCAL_CS|ENGCRS|GEOCCS/.test(text);
  return {
    isGeographic: !isProjected && /GEOG(CS|CRS)/.test(text),
    ground: ground ?? 1,
    ...(up !== undefined && { up }),
  };
}
