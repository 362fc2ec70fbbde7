#include "samples/box_mesh.hpp"

#include "core/morton.hpp"

#include <algorithm>

namespace hexopt {

namespace {

constexpr std::uint64_t kMask = (1u << 21) - 1;

std::uint64_t key_of(std::uint64_t i, std::uint64_t j, std::uint64_t k) { return k << 42 | j << 21 | i; }

std::array<std::uint32_t, 3> place_of(std::uint64_t key) {
    return {static_cast<std::uint32_t>(key & kMask), static_cast<std::uint32_t>(key >> 21 & kMask),
            static_cast<std::uint32_t>(key >> 42)};
}

std::uint64_t morton_of(const LatticeBox& box) { return morton_code(box.low[0], box.low[1], box.low[2]); }

using Keys = std::vector<std::uint64_t>; ///< sorted places of the boxes of one level

void sort_unique(Keys& keys) {
    std::sort(keys.begin(), keys.end());
    keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
}

bool contains(const Keys& keys, std::uint64_t key) {
    return std::binary_search(keys.begin(), keys.end(), key);
}

Keys children_of(const Keys& keys) {
    Keys children;
    children.reserve(keys.size() * 8);
    for (std::uint64_t key : keys) {
        const auto [i, j, k] = place_of(key);
        for (std::uint32_t c = 0; c < 8; ++c)
            children.push_back(key_of(2 * i + (c & 1), 2 * j + (c >> 1 & 1), 2 * k + (c >> 2)));
    }
    sort_unique(children);
    return children;
}

class Forest {
  public:
    explicit Forest(const OctreeOptions& options) : options_(options), refined_(options.levels) {
        for (std::uint64_t k = 0; k < options.roots[2]; ++k)
            for (std::uint64_t j = 0; j < options.roots[1]; ++j)
                for (std::uint64_t i = 0; i < options.roots[0]; ++i) roots_.push_back(key_of(i, j, k));
    }

    void refine() {
        Keys nodes = roots_;
        for (int level = 0; level < options_.levels; ++level) {
            for (std::uint64_t key : nodes)
                if (options_.refine && ask(options_.refine, key, level)) refined_[level].push_back(key);
            nodes = children_of(refined_[level]);
        }
        for (int level = options_.levels - 1; level > 0; --level) balance(level);
    }

    std::vector<LatticeBox> leaves() const {
        std::vector<LatticeBox> boxes;
        Keys nodes = roots_;
        for (int level = 0; level <= options_.levels; ++level) {
            for (std::uint64_t key : nodes)
                if (level == options_.levels || !contains(refined_[level], key))
                    append_leaf(key, level, boxes);
            if (level < options_.levels) nodes = children_of(refined_[level]);
        }
        std::sort(boxes.begin(), boxes.end(),
                  [](const LatticeBox& a, const LatticeBox& b) { return morton_of(a) < morton_of(b); });
        return boxes;
    }

  private:
    using Question = std::function<bool(Point, Point)>;

    static bool ask(const Question& question, std::uint64_t key, int level) {
        const auto [i, j, k] = place_of(key);
        const double h = 1.0 / (1 << level);
        return question(Point(i, j, k) * h, Point(i + 1, j + 1, k + 1) * h);
    }

    /// The boxes round a refined one must exist on its level: their parents are refined too.
    void balance(int level) {
        Keys& parents = refined_[level - 1];
        std::array<std::int64_t, 3> end;
        for (int axis = 0; axis < 3; ++axis) end[axis] = std::int64_t{options_.roots[axis]} << level;
        for (std::uint64_t key : refined_[level]) {
            const auto place = place_of(key);
            for (int n = 0; n < 27; ++n) {
                const std::int64_t i = std::int64_t{place[0]} + n % 3 - 1,
                                   j = std::int64_t{place[1]} + n / 3 % 3 - 1,
                                   k = std::int64_t{place[2]} + n / 9 - 1;
                if (i < 0 || j < 0 || k < 0 || i >= end[0] || j >= end[1] || k >= end[2]) continue;
                parents.push_back(key_of(i / 2, j / 2, k / 2));
            }
        }
        sort_unique(parents);
    }

    void append_leaf(std::uint64_t key, int level, std::vector<LatticeBox>& boxes) const {
        if (options_.keep && !ask(options_.keep, key, level)) return;
        const std::uint32_t size = lattice_units(options_.levels) >> level;
        const auto [i, j, k] = place_of(key);
        LatticeBox box{{i * size, j * size, k * size}, {size, size, size}, static_cast<std::uint8_t>(level)};
        if (!options_.halve_x || !ask(options_.halve_x, key, level)) {
            boxes.push_back(box);
            return;
        }
        box.size[0] /= 2;
        boxes.push_back(box);
        box.low[0] += box.size[0];
        boxes.push_back(box);
    }

    const OctreeOptions& options_;
    Keys roots_;
    std::vector<Keys> refined_; ///< per level: boxes that have children
};

} // namespace

std::vector<LatticeBox> make_octree_boxes(const OctreeOptions& options) {
    Forest forest(options);
    forest.refine();
    return forest.leaves();
}

} // namespace hexopt
