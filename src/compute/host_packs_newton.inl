// shaders/kernels/newton_vertex.glsl on kLanes vertices at once. Included inside a namespace a precision.
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

inline void move_lanes(const NewtonArgs& a, const std::uint32_t* dofs, std::uint32_t cells, int lanes) {
    PackCell cell[kMaxCells];
    const real eps(a.eps), omega(a.omega);
    LocalModel m = model_zero();
    for (std::uint32_t i = 0; i < cells; ++i) {
        load_cells(a, dofs, i, cell[i]);
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
    const rvec3 step = d * search_length(l, m.energy, slope, omega);
    for (int lane = 0; lane < lanes; ++lane) {
        if (!(slope[lane] < 0)) continue;
        point_real* p = a.points + 3 * std::size_t{a.dof_vertex[dofs[lane]]};
        p[0] += static_cast<point_real>(step.x[lane]);
        p[1] += static_cast<point_real>(step.y[lane]);
        p[2] += static_cast<point_real>(step.z[lane]);
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
