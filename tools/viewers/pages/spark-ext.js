// Spark with floats for colors, scales and opacities in the place of bytes.

import { openWith } from './spark.js';

export const open = (...what) => openWith({ extSplats: true }, ...what);
