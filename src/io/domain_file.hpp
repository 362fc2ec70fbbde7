#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "mesh/domain_description.hpp"

#include <filesystem>

namespace hexopt {

/// Whether a path is named as domain files are (.hxd).
bool is_domain_name(const std::filesystem::path& path);

/// Reads a domain file (docs/domain-file.md). Everything is checked but whether the entities fit one another,
/// which build_domain() does. Errors: bad_input with file, line and what to do; out_of_memory; cancelled.
Result<DomainDescription> read_domain_file(const std::filesystem::path& path, Context& context);

/// Writes a domain file, which appears whole or not at all; reading it gives the same bits. Errors:
/// output_failed.
Status write_domain_file(const std::filesystem::path& path, const DomainDescription& domain,
                         Context& context);

} // namespace hexopt
