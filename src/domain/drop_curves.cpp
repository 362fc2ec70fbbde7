#include "domain/drop_curves.hpp"

#include <algorithm>
#include <set>

namespace hexopt {

Result<Domain> drop_curves(const Domain& domain, std::span<const Index> curves, Context& context) {
    DomainDescription left = describe_domain(domain);
    const auto is_dropped = [&](const DomainDescription::Entity& entity) {
        return std::binary_search(curves.begin(), curves.end(), static_cast<Index>(entity.number - 1));
    };
    std::erase_if(left.curves, is_dropped);
    std::erase_if(left.polylines, is_dropped);
    std::set<std::int64_t> ends;
    for (const DomainDescription::Curve& curve : left.curves)
        if (curve.ends) ends.insert(curve.ends->begin(), curve.ends->end());
    std::erase_if(left.corners, [&](const DomainDescription::Corner& corner) {
        return !corner.alone && !ends.contains(corner.number);
    });
    // Patches that become one are found by where they meet; curves say less of their sides than that does.
    for (DomainDescription::Curve& curve : left.curves) curve.patches.clear();
    auto dropped = build_domain(left, context);
    if (dropped) dropped->name_group = domain.name_group;
    return dropped;
}

} // namespace hexopt
