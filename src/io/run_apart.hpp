#pragma once

#include "core/context.hpp"
#include "core/result.hpp"

#include <functional>
#include <string>

namespace hexopt::io_detail {

/// Runs `work` in a process of its own (fork) and returns what it returned: for libraries that a damaged file
/// can crash, exhaust the memory of, or keep busy for ever. work must not start threads nor throw. It may use
/// at most memory_bytes more than the caller has mapped, and dies with the caller. file: for messages.
/// Errors: bad_input (it crashed, or ended early), out_of_memory (no process to be had), cancelled (at once,
/// whatever work does).
Result<std::string> run_apart(const std::string& file, std::size_t memory_bytes, unsigned cpu_seconds,
                              const Context& context, const std::function<std::string()>& work);

} // namespace hexopt::io_detail
