// Scalars of conjugate gradients, a vec4 for each group of four right-hand sides.
const int kRho = 0;        // r . z
const int kRhoBefore = 1;  // of the iteration before
const int kGamma = 2;      // p . K p
const int kNorm = 3;       // r . r
const int kSource = 4;     // b . b
