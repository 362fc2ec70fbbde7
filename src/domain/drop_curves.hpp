#pragma once

#include "domain/domain.hpp"

#include <span>

namespace hexopt {

/// The domain without some of its curves: patches that they parted become one, corners that end no curve any
/// more are none. The curves that are left keep their order. curves: rising. Errors: cancelled, and
/// bad_input where what is left cannot be built.
Result<Domain> drop_curves(const Domain& domain, std::span<const Index> curves, Context& context);

} // namespace hexopt
