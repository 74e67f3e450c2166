// Which sum is where: reconstruct/vulkan/sums.h.
const int kChiSquared = 0;
const int kSmoothDiffusion = 1;
const int kSmoothAbsorption = 2;
const int kMove = 3;     // max |d|
const int kPromised = 4; // g . s
const int kSlope = 5;    // g . d
const int kNewSlope = 6; // g' . d
const int kSquare = 7;   // g~' . g~'
const int kLargest = 8;  // max |g~'|
const int kOwn = 9;      // s.s, s.y, y.s, y.y, g~'.s, g~'.y; then the same with each remembered pair
