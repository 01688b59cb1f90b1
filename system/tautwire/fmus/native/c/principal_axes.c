/* Principal axes of an inertia by Jacobi's method, as in rigid_body.py: nearest to x, y and z, by rows. */

#define MAX_JACOBI_SWEEPS 30

static void turn_rows(double matrix[3][3], int p, int q, double cosine, double sine) {
  int k;
  for (k = 0; k < 3; k++) {
    double first = matrix[p][k], second = matrix[q][k];
    matrix[p][k] = cosine * first - sine * second;
    matrix[q][k] = sine * first + cosine * second;
  }
}

static void transpose(double matrix[3][3]) {
  int p, q;
  for (p = 0; p < 3; p++)
    for (q = p + 1; q < 3; q++) {
      double entry = matrix[p][q];
      matrix[p][q] = matrix[q][p];
      matrix[q][p] = entry;
    }
}

static void diagonalise(double entries[3][3], double axes[3][3]) {
  static const int pairs[3][2] = {{0, 1}, {0, 2}, {1, 2}};
  int sweep, k;
  for (sweep = 0; sweep < MAX_JACOBI_SWEEPS; sweep++)
    for (k = 0; k < 3; k++) {
      int p = pairs[k][0], q = pairs[k][1];
      double ratio, tangent, cosine;
      if (entries[p][q] == 0.0) continue;
      ratio = (entries[q][q] - entries[p][p]) / (2.0 * entries[p][q]);
      tangent = copysign(1.0, ratio) / (fabs(ratio) + hypot(ratio, 1.0));
      cosine = 1.0 / hypot(tangent, 1.0);
      turn_rows(entries, p, q, cosine, tangent * cosine);
      transpose(entries);
      turn_rows(entries, p, q, cosine, tangent * cosine);
      entries[p][q] = entries[q][p] = 0.0;
      turn_rows(axes, p, q, cosine, tangent * cosine);
    }
}

/* `inertia` has the entries xx, yy, zz, xy, xz, yz. */
static void principal_axes(const double *inertia, double *result) {
  static const int orders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  double entries[3][3] = {{inertia[0], inertia[3], inertia[4]},
                          {inertia[3], inertia[1], inertia[5]},
                          {inertia[4], inertia[5], inertia[2]}};
  double axes[3][3] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}}, best = -1.0;
  int order, nearest = 0, k, j;
  diagonalise(entries, axes);
  for (order = 0; order < 6; order++) {
    double nearness = 0.0;
    for (k = 0; k < 3; k++) nearness += fabs(axes[orders[order][k]][k]);
    if (nearness > best) {
      best = nearness;
      nearest = order;
    }
  }
  for (k = 0; k < 3; k++)
    for (j = 0; j < 3; j++) {
      const double *axis = axes[orders[nearest][k]];
      result[3 * k + j] = copysign(1.0, axis[k]) * axis[j];
    }
}
