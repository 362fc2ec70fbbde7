#include "pipeline/entity_map.hpp"

namespace hexopt {

Association EntityMap::operator()(Association bound) const {
    const std::vector<Index>* numbers = bound.kind == EntityKind::patch    ? &patch
                                        : bound.kind == EntityKind::curve  ? &curve
                                        : bound.kind == EntityKind::corner ? &corner
                                                                           : nullptr;
    if (numbers) bound.entity = bound.entity < numbers->size() ? (*numbers)[bound.entity] : kNoIndex;
    return bound;
}

} // namespace hexopt
