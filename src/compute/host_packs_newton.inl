// shaders/kernels/newton_vertex.glsl and newton_regular.glsl on kLanes vertices at once. Included inside a
// namespace a precision.
#include "dialect/simd_types.hpp"

#include "math/scaled_jacobian.glsl"
#include "math/tet_energy.glsl"

#include "math/sym3.glsl"

#include "math/corner_ball.glsl"

using point_real = HEXOPT_POINT_REAL;

/// The kernel's argument block (kernels.def).
struct NewtonArgs {
    point_real* points;
    const std::uint32_t* cells;
    const lane_real* inverse_length;
    const lane_real* cell_weight;
    const std::uint32_t* ball_offset;
    const std::uint32_t* ball_item;
    const lane_real* pattern;
    const std::uint32_t* dof_vertex;
    const std::uint32_t* dof_list;
    float eps, omega;
    std::uint32_t count;
};

struct RegularArgs {
    point_real* points;
    const std::uint32_t* stencil;
    const lane_real* inverse_length;
    const lane_real* cell_weight;
    float eps, omega;
    std::uint32_t count;
};

/// One cell of each lane's ball: its other corners relative to the lane's vertex, in target lengths.
struct PackCell {
    rvec3 corner[7];
    real inverse, factor;
};

inline constexpr std::uint32_t kMaxCells = 32;

/// Vertices of a cell by place (x + 2y + 4z, from 1) once it is turned as turned_vertex() does.
struct TurnTable {
    std::uint8_t vertex[8][7];
};
inline constexpr TurnTable kTurn = [] {
    TurnTable table{};
    for (unsigned corner = 0; corner < 8; ++corner) {
        const unsigned cx = (corner ^ corner >> 1) & 1, cy = corner >> 1 & 1, cz = corner >> 2;
        const bool odd = (cx ^ cy ^ cz) == 1;
        for (unsigned place = 1; place < 8; ++place) {
            const unsigned x = place & 1, y = place >> 1 & 1, z = place >> 2;
            const unsigned ax = (odd ? y : x) ^ cx, ay = (odd ? x : y) ^ cy, az = z ^ cz;
            table.vertex[corner][place - 1] = static_cast<std::uint8_t>((ax ^ ay) + 2 * ay + 4 * az);
        }
    }
    return table;
}();

inline real load_pack(const lane_real* from) {
    real r;
    __builtin_memcpy(&r.v, from, sizeof r.v);
    return r;
}

/// Lanes whose ball is shorter repeat their last cell with factor 0.
inline void load_cells(const NewtonArgs& a, const std::uint32_t* dofs, std::uint32_t place, PackCell& cell) {
    alignas(64) lane_real local[21][kLanes], inverse[kLanes], factor[kLanes];
    for (int lane = 0; lane < kLanes; ++lane) {
        const std::uint32_t first = a.ball_offset[dofs[lane]], size = a.ball_offset[dofs[lane] + 1] - first;
        const std::uint32_t* item = a.ball_item + 2 * (first + std::min(place, size - 1));
        const std::uint32_t* vertices = a.cells + 8 * std::size_t{item[0]};
        const point_real* centre = a.points + 3 * std::size_t{vertices[item[1]]};
        for (int k = 0; k < 7; ++k) {
            const point_real* p = a.points + 3 * std::size_t{vertices[kTurn.vertex[item[1]][k]]};
            for (int axis = 0; axis < 3; ++axis)
                local[3 * k + axis][lane] = static_cast<lane_real>(p[axis] - centre[axis]);
        }
        inverse[lane] = a.inverse_length[item[0]];
        factor[lane] = place < size ? a.cell_weight[item[0]] : lane_real(0);
    }
    cell.inverse = load_pack(inverse);
    cell.factor = load_pack(factor);
    for (int k = 0; k < 7; ++k)
        cell.corner[k] =
            rvec3(load_pack(local[3 * k]), load_pack(local[3 * k + 1]), load_pack(local[3 * k + 2])) *
            cell.inverse;
}

inline CornerEdges edges_of(const PackCell& c) {
    return corner_edges(c.corner[0], c.corner[1], c.corner[2], c.corner[3], c.corner[4], c.corner[5],
                        c.corner[6]);
}

/// The dofs' longest ball; 0 where some ball is empty, too long or has a cell that hangs on its dof.
inline std::uint32_t longest_ball(const NewtonArgs& a, const std::uint32_t* dofs) {
    std::uint32_t longest = 0;
    for (int lane = 0; lane < kLanes; ++lane) {
        const std::uint32_t first = a.ball_offset[dofs[lane]], last = a.ball_offset[dofs[lane] + 1];
        if (first == last) return 0;
        for (std::uint32_t i = first; i < last; ++i)
            if (a.ball_item[2 * i + 1] >= 8) return 0;
        longest = std::max(longest, last - first);
    }
    return longest <= kMaxCells ? longest : 0;
}

/// The step of each lane, to be taken where the slope is negative.
struct Step {
    rvec3 move;
    real slope;
};

inline Step find_step(const PackCell* cell, std::uint32_t cells, float eps_, float omega_) {
    const real eps(eps_), omega(omega_);
    LocalModel m = model_zero();
    for (std::uint32_t i = 0; i < cells; ++i) {
        const real inverse = cell[i].inverse, factor = cell[i].factor * real(1.0f);
        const LocalModel part = corner_model(edges_of(cell[i]), eps);
        m.energy += part.energy * factor;
        m.gradient = m.gradient + part.gradient * (factor * inverse);
        m.hessian = add_scaled(m.hessian, part.hessian, factor * inverse * inverse);
    }
    const rvec3 d = newton_step(m);
    const real slope = dot(m.gradient, d);
    LineEnergies l = line_zero();
    for (std::uint32_t i = 0; i < cells; ++i)
        l = add_lines(l, corner_line(edges_of(cell[i]), d * cell[i].inverse, omega, eps), cell[i].factor);
    return {d * search_length(l, m.energy, slope, omega), slope};
}

inline void move_lane(point_real* p, const Step& step, int lane) {
    if (!(step.slope[lane] < 0)) return;
    p[0] += static_cast<point_real>(step.move.x[lane]);
    p[1] += static_cast<point_real>(step.move.y[lane]);
    p[2] += static_cast<point_real>(step.move.z[lane]);
}

inline void move_lanes(const NewtonArgs& a, const std::uint32_t* dofs, std::uint32_t cells, int lanes) {
    PackCell cell[kMaxCells];
    for (std::uint32_t i = 0; i < cells; ++i) load_cells(a, dofs, i, cell[i]);
    const Step step = find_step(cell, cells, a.eps, a.omega);
    for (int lane = 0; lane < lanes; ++lane)
        move_lane(a.points + 3 * std::size_t{a.dof_vertex[dofs[lane]]}, step, lane);
}

/// Places in a block (x + 3 y + 9 z) of each octant's other corners, as octant_edges() takes them.
struct OctantTable {
    std::uint8_t place[8][7];
};
inline constexpr OctantTable kOctant = [] {
    OctantTable table{};
    for (unsigned octant = 0; octant < 8; ++octant) {
        const unsigned x = octant & 1, y = octant >> 1 & 1, z = octant >> 2;
        const bool odd = (x ^ y ^ z) == 1;
        for (unsigned corner = 1; corner < 8; ++corner) {
            const unsigned u = corner & 1, v = corner >> 1 & 1, w = corner >> 2;
            const unsigned ax = odd ? v : u, ay = odd ? u : v;
            const unsigned i = 1 + ax - 2 * ax * x, j = 1 + ay - 2 * ay * y, k = 1 + w - 2 * w * z;
            table.place[octant][corner - 1] = static_cast<std::uint8_t>(i + 3 * j + 9 * k);
        }
    }
    return table;
}();

inline void newton_regular_vertices(HostFunction, const void* args, std::uint32_t begin, std::uint32_t end) {
    const RegularArgs& a = *static_cast<const RegularArgs*>(args);
    for (std::uint32_t first = begin; first < end; first += kLanes) {
        const auto lanes = static_cast<int>(std::min<std::uint32_t>(kLanes, end - first));
        alignas(64) lane_real local[81][kLanes], inverse[8][kLanes], factor[8][kLanes];
        const std::uint32_t* row[kLanes];
        for (int lane = 0; lane < kLanes; ++lane) {
            row[lane] =
                a.stencil + 35 * std::size_t{first + static_cast<unsigned>(std::min(lane, lanes - 1))};
            const point_real* centre = a.points + 3 * std::size_t{row[lane][13]};
            for (int place = 0; place < 27; ++place)
                for (int axis = 0; axis < 3; ++axis)
                    local[3 * place + axis][lane] = static_cast<lane_real>(
                        a.points[3 * std::size_t{row[lane][place]} + static_cast<unsigned>(axis)] -
                        centre[axis]);
            for (int octant = 0; octant < 8; ++octant) {
                inverse[octant][lane] = a.inverse_length[row[lane][27 + octant]];
                factor[octant][lane] = a.cell_weight[row[lane][27 + octant]];
            }
        }
        PackCell cell[8];
        for (int octant = 0; octant < 8; ++octant) {
            cell[octant].inverse = load_pack(inverse[octant]);
            cell[octant].factor = load_pack(factor[octant]);
            for (int k = 0; k < 7; ++k) {
                const auto at = local + 3 * kOctant.place[octant][k];
                cell[octant].corner[k] =
                    rvec3(load_pack(at[0]), load_pack(at[1]), load_pack(at[2])) * cell[octant].inverse;
            }
        }
        const Step step = find_step(cell, 8, a.eps, a.omega);
        for (int lane = 0; lane < lanes; ++lane)
            move_lane(a.points + 3 * std::size_t{row[lane][13]}, step, lane);
    }
}

inline void newton_vertices(HostFunction scalar, const void* args, std::uint32_t begin, std::uint32_t end) {
    const NewtonArgs& a = *static_cast<const NewtonArgs*>(args);
    for (std::uint32_t i = begin; i < end; i += kLanes) {
        const auto lanes = static_cast<int>(std::min<std::uint32_t>(kLanes, end - i));
        std::uint32_t dofs[kLanes];
        for (int lane = 0; lane < kLanes; ++lane)
            dofs[lane] = a.dof_list[i + static_cast<unsigned>(std::min(lane, lanes - 1))];
        if (const std::uint32_t cells = longest_ball(a, dofs); cells > 0)
            move_lanes(a, dofs, cells, lanes);
        else
            scalar(args, i, i + static_cast<unsigned>(lanes), nullptr);
    }
}
