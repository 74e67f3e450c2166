// The centroid of e^(-t x) on a cell, beta before its middle, and dbeta/dt (reconstruct/diffusion/centroid.h).

// e^x - 1; below 1/2 by its series, whose ninth term is below float32's rounding
float exp_minus_one(float x) {
  if (abs(x) > 0.5) return exp(x) - 1.0;
  float sum = 1.0;
  for (int n = 9; n > 1; --n) sum = 1.0 + sum * x / float(n);
  return x * sum;
}
// Below t = 1 the closed forms cancel; there Bernoulli's series t/12 - t^3/720 + t^5/30240 - t^7/1209600 + t^9/47900160.
float beta_of(float t) {
  const float s = t * t;
  if (t < 1.0)
    return t * (1.0 / 12.0 - s * (1.0 / 720.0 - s * (1.0 / 30240.0 - s * (1.0 / 1209600.0 - s / 47900160.0))));
  return 0.5 - 1.0 / t + 1.0 / exp_minus_one(t);
}
float beta_slope_of(float t) {
  const float s = t * t;
  if (t < 1.0)
    return 1.0 / 12.0 - s * (1.0 / 240.0 - s * (1.0 / 6048.0 - s * (1.0 / 172800.0 - s / 5322240.0)));
  return 1.0 / s + 1.0 / (exp_minus_one(t) * exp_minus_one(-t));
}
