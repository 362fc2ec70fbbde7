#pragma once

#include "domain/boundary_model.hpp"

#include <vector>

namespace hexopt {

/// Numbers of one domain's entities in another, kNoIndex where it has them not.
struct EntityMap {
    std::vector<Index> patch, curve, corner;
    Association operator()(Association bound) const;
};

} // namespace hexopt
