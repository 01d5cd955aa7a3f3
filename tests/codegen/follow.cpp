// Follows steps of a tracker: products of joint transforms, Newton's method on the relations of the joints that are cut.
// It shares nothing with the tracker but the names of coordinates. WIDE steps go side by side.
//
// Argument: a file of numbers: motors M, unknowns N, coordinates C; of each its place among motors and unknowns,
// slides, parent, zero, axis, point; relations: kind, two bodies, u, v, point (kinds below). Characteristic lengths, rad.
// Input: records of doubles: ways, motors before and after, unknowns before and after. Output: wrong, unsure.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

constexpr int WIDE = 4, PIECES = 500;
typedef double V __attribute__((vector_size(8 * WIDE)));
typedef long long Mask __attribute__((vector_size(8 * WIDE)));
typedef std::vector<V> Vs;

enum Kind { POINT, DIRECTION, ALONG, COUPLING };  // b = a; u.v kept; k.(b - a) = 0; second - ratio first = 0
struct Coordinate {
  int place, slides, parent;
  double zero, axis[3], point[3];
};
struct Relation {
  int kind, body[2];
  double u[3], v[3], point[3];
  std::vector<int> way[2];  // unknowns and motors that only one of its bodies is behind
};
struct Vec {
  V x, y, z;
};
struct Body {
  Vec column[3], at, axis;  // R, the place of the coordinate's point, its axis before it turns
};

static Vec operator+(const Vec& a, const Vec& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
static Vec operator-(const Vec& a, const Vec& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
static V dot(const Vec& a, const Vec& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static Vec cross(const Vec& a, const Vec& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
static Vec scaled(const Vec& a, const V& c) { return {a.x * c, a.y * c, a.z * c}; }
static V absolute(const V& x) { return x < 0.0 ? -x : x; }
static bool all(const Mask& m) {
  for (int i = 0; i < WIDE; ++i)
    if (!m[i]) return false;
  return true;
}

static void turn(const V& x, V& s, V& c) {  // by series, of at most an eighth of a turn
  const V shift = V{} + 0x1.8p52, k = (x * 0x1.45f306dc9c883p-1 + shift) - shift;
  const V r = (x - k * 0x1.921fb54442d18p0) - k * 0x1.1a62633145c07p-54, t = r * r;
  V sine = V{}, cosine = V{};
  for (int i = 17; i >= 3; i -= 2) sine = (1.0 + sine) * t * (-1.0 / (i * (i - 1)));
  for (int i = 18; i >= 2; i -= 2) cosine = (1.0 + cosine) * t * (-1.0 / (i * (i - 1)));
  sine = r + r * sine, cosine = 1.0 + cosine;
  const Mask quarter = __builtin_convertvector(k, Mask);
  const V one = (quarter & 1) ? cosine : sine, other = (quarter & 1) ? sine : cosine;
  s = (quarter & 2) ? -one : one, c = ((quarter + 1) & 2) ? -other : other;
}

static int M, N, C;
static std::vector<Coordinate> tree;
static std::vector<Relation> relations;
static std::vector<Body> bodies;
static Vs G, J, A, move_;

static Vec turned(int body, const double* p) {
  if (body < 0) return {V{} + p[0], V{} + p[1], V{} + p[2]};
  const Vec* R = bodies[body].column;
  return {R[0].x * p[0] + R[1].x * p[1] + R[2].x * p[2], R[0].y * p[0] + R[1].y * p[1] + R[2].y * p[2],
          R[0].z * p[0] + R[1].z * p[1] + R[2].z * p[2]};
}
static Vec carried(int body, const double* p) {
  if (body < 0) return turned(body, p);
  const double* c = tree[body].point;
  const double from[] = {p[0] - c[0], p[1] - c[1], p[2] - c[2]};
  return bodies[body].at + turned(body, from);
}

// Relations, and with `slopes` their derivatives by the unknowns.
static void evaluate(const Vs& q, const Vs& x, bool slopes) {
  for (int i = 0; i < C; ++i) {
    const Coordinate& own = tree[i];
    Body& b = bodies[i];
    const V value = (own.place < M ? q[own.place] : x[own.place - M]) - own.zero;
    b.axis = turned(own.parent, own.axis), b.at = carried(own.parent, own.point);
    const double* a = own.axis;
    V s = V{}, c = V{} + 1.0;
    if (own.slides) b.at = b.at + scaled(b.axis, value);
    else turn(value, s, c);
    const double e[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (int k = 0; k < 3; ++k) {  // R e = R a (a.e) (1 - c) + R e c + R (a x e) s
      const double across[] = {a[1] * e[k][2] - a[2] * e[k][1], a[2] * e[k][0] - a[0] * e[k][2],
                               a[0] * e[k][1] - a[1] * e[k][0]};
      b.column[k] = scaled(turned(own.parent, e[k]), c) + scaled(turned(own.parent, across), s) +
                    scaled(b.axis, (1.0 - c) * a[k]);
    }
  }
  if (slopes) std::fill(J.begin(), J.end(), V{});
  int row = 0;
  for (const Relation& each : relations) {
    const int kind = each.kind, rows = kind == POINT ? 3 : 1;
    if (kind == COUPLING) {
      const double factor[] = {-each.u[0], 1.0};
      G[row] = V{};
      for (int side = 0; side < 2; ++side) {
        const Coordinate& own = tree[each.body[side]];
        G[row] += factor[side] * ((own.place < M ? q[own.place] : x[own.place - M]) - own.zero);
        if (slopes && own.place >= M) J[row * N + own.place - M] += factor[side];
      }
      ++row;
      continue;
    }
    const Vec p[] = {carried(each.body[0], each.point), carried(each.body[1], each.point)}, gap = p[1] - p[0];
    const Vec d[] = {turned(each.body[0], each.u), turned(each.body[1], each.v)};
    if (kind == POINT) G[row] = gap.x, G[row + 1] = gap.y, G[row + 2] = gap.z;
    else if (kind == ALONG) G[row] = dot(d[0], gap);
    else G[row] = dot(d[0], d[1]) - (each.u[0] * each.v[0] + each.u[1] * each.v[1] + each.u[2] * each.v[2]);
    for (int side = 0; side < 2 && slopes; ++side)
      for (int i : each.way[side]) {
        const Coordinate& own = tree[i];
        if (own.place < M) continue;
        const Vec w = bodies[i].axis, rate = own.slides ? w : cross(w, p[side] - bodies[i].at);
        V* const to = &J[row * N + own.place - M];
        const double sign = side ? 1.0 : -1.0;
        if (kind == POINT) to[0] += sign * rate.x, to[N] += sign * rate.y, to[2 * N] += sign * rate.z;
        if (kind == ALONG) to[0] += sign * dot(d[0], rate);
        if (kind == ALONG && !side && !own.slides) to[0] += dot(cross(w, d[0]), gap);
        if (kind == DIRECTION && !own.slides) to[0] += dot(cross(w, d[side]), d[1 - side]);
      }
    row += rows;
  }
}

static void factorise() {  // A = L D L^T of J^T J
  const int rows = int(G.size());
  for (int i = 0; i < N; ++i)
    for (int k = 0; k <= i; ++k) {
      V sum = V{};
      for (int r = 0; r < rows; ++r) sum += J[r * N + i] * J[r * N + k];
      A[i * N + k] = sum;
    }
  for (int k = 0; k < N; ++k) {
    const V inverse = 1.0 / A[k * N + k];
    for (int i = k + 1; i < N; ++i) {
      const V factor = A[i * N + k] * inverse;
      for (int j = k + 1; j <= i; ++j) A[i * N + j] -= factor * A[j * N + k];
    }
    for (int i = k + 1; i < N; ++i) A[i * N + k] *= inverse;
  }
}

static void correct(Vs& x) {
  for (int i = 0; i < N; ++i) move_[i] = V{};
  for (size_t r = 0; r < G.size(); ++r)
    for (int i = 0; i < N; ++i) move_[i] += J[r * N + i] * G[r];
  for (int i = 0; i < N; ++i)
    for (int k = 0; k < i; ++k) move_[i] -= A[i * N + k] * move_[k];
  for (int i = N - 1; i >= 0; --i) {
    move_[i] /= A[i * N + i];
    for (int k = i + 1; k < N; ++k) move_[i] -= A[k * N + i] * move_[k];
  }
  for (int i = 0; i < N; ++i) x[i] -= move_[i];
}

static Mask is_closed(double tolerance) {
  Mask good = Mask{} - 1;
  for (const V& g : G) good &= absolute(g) <= tolerance;
  return good;
}

// x along lines of motors in pieces, each from the last with corrections that stay short, and where not, in shorter ones;
// returns the lanes that were followed.
static Mask follow(const Vs& from, const Vs& to, Vs& x, int pieces, int deeper) {
  Mask followed = Mask{} - 1;
  Vs before = x, first = x, here = from, next = from, y = x;
  bool fresh = false;
  for (int k = 1; k <= pieces; ++k) {
    for (int m = 0; m < M; ++m) next[m] = from[m] + (to[m] - from[m]) * (double(k) / pieces);
    for (int i = 0; i < N; ++i) y[i] = k < 3 ? x[i] : 3.0 * (x[i] - before[i]) + first[i];
    Mask good = Mask{};
    for (int step = 0; step < 9; ++step) {
      const bool renew = !fresh || (step > 3 && step % 2 == 0) || (k == pieces && step < 2);
      evaluate(next, y, renew);
      good = is_closed(1e-12);
      if (all(good) && !(k == pieces && step < 2)) break;
      if (renew) factorise();
      fresh = true;
      correct(y);
    }
    fresh = fresh && k % 50 != 0;
    for (int i = 0; i < N; ++i) good &= absolute(y[i] - x[i]) < 0.01;
    if (!all(good)) {
      Vs again = x;
      const Mask other = deeper ? follow(here, next, again, 100, deeper - 1) : Mask{};
      for (int i = 0; i < N; ++i) y[i] = good ? y[i] : again[i];
      followed &= good | other;
      for (int i = 0; i < N; ++i) y[i] = followed ? y[i] : x[i];
      fresh = false;
    }
    first = before, before = x, x = y, here = next;
  }
  return followed;
}

struct Lane {
  std::vector<double> record;
  int ways = 0, way = 0, edge = 0;
  bool good = true;
};

int main(int, char** argv) {
  FILE* file = std::fopen(argv[1], "r");
  int count = 0, rows = 0;
  const auto number = [file] {
    double found = 0.0;
    if (std::fscanf(file, "%lf", &found) != 1) std::exit(2);
    return found;
  };
  M = int(number()), N = int(number()), C = int(number());
  tree.resize(C), bodies.resize(C);
  for (Coordinate& each : tree) {
    each.place = int(number()), each.slides = int(number()), each.parent = int(number()), each.zero = number();
    for (double& a : each.axis) a = number();
    for (double& p : each.point) p = number();
  }
  relations.resize(int(number()));
  for (Relation& each : relations) {
    each.kind = int(number()), each.body[0] = int(number()), each.body[1] = int(number());
    for (double* v : {each.u, each.v, each.point})
      for (int k = 0; k < 3; ++k) v[k] = number();
    for (int side = 0; side < 2; ++side)
      for (int i = each.body[side]; i >= 0; i = tree[i].parent) {
        bool shared = false;
        for (int k = each.body[1 - side]; k >= 0; k = tree[k].parent) shared = shared || i == k;
        if (!shared) each.way[side].push_back(i);
      }
    rows += each.kind == POINT ? 3 : 1;
  }
  G.resize(rows), J.resize(rows * N), A.resize(N * N), move_.resize(N);
  const size_t size = 1 + 2 * M + 2 * N;
  long wrong = 0, unsure = 0;
  std::vector<Lane> lanes(WIDE);
  Vs from(M), to(M), x(N);
  while (true) {
    int busy = 0;
    for (int lane = 0; lane < WIDE; ++lane) {
      Lane& own = lanes[lane];
      if (own.way == own.ways) {
        own.record.resize(size);
        own.way = own.edge = own.ways = 0;
        if (std::fread(own.record.data(), sizeof(double), size, stdin) == size) own.ways = int(own.record[0]), ++count;
        else own.record = lanes[0].record;  // it rests where another is
      }
      busy += own.ways > 0;
      const double *q = own.record.data() + 1, *end = q + M, *start = q + 2 * M;
      for (int m = 0; m < M; ++m) {
        // the line; motor after motor, upwards or downwards
        const int order = own.way == 1 ? m : M - 1 - m;
        const bool all_ = own.way == 0;
        from[m][lane] = all_ || order >= own.edge ? q[m] : end[m];
        to[m][lane] = own.ways && (all_ || order <= own.edge) ? end[m] : from[m][lane];
      }
      for (int i = 0; i < N && own.edge == 0; ++i) x[i][lane] = start[i];
      if (own.edge == 0) own.good = true;
    }
    if (!busy) break;
    const Mask followed = follow(from, to, x, PIECES, 2);
    for (int lane = 0; lane < WIDE; ++lane) {
      Lane& own = lanes[lane];
      if (!own.ways) continue;
      own.good = own.good && followed[lane];
      if (own.way > 0 && ++own.edge < M) continue;
      bool there = true;
      for (int i = 0; i < N; ++i) there = there && std::abs(x[i][lane] - own.record[1 + 2 * M + N + i]) < 1e-9;
      if (!own.good) ++unsure;
      else if (!there) ++wrong;
      own.edge = 0, ++own.way;
    }
  }
  std::printf("%d %ld %ld\n", count, wrong, unsure);
}
