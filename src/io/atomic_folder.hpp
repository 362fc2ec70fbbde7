#pragma once

#include "core/context.hpp"
#include "core/result.hpp"

#include <filesystem>
#include <set>
#include <string>

namespace hexopt {

/// A folder that appears under its name whole or not at all. Files go into a temporary folder beside the
/// target (each through AtomicFile); commit() flushes it and exchanges it with the target in one step, then
/// removes what was there. Until then an earlier folder stays as it was; without a commit the temporary is
/// removed.
///
/// Errors: output_failed (no space, no permission, the target is a file, or holds something that is not in
/// `replaceable`, which would be lost), cancelled as for AtomicFile.
class AtomicFolder {
  public:
    /// Whether a folder may go there, for who wants to know before there is one; looks at names only.
    static Status check(const std::filesystem::path& target, const std::set<std::string>& replaceable);

    /// replaceable: names that may be thrown away with an earlier folder.
    static Result<AtomicFolder> create(const std::filesystem::path& target,
                                       const std::set<std::string>& replaceable, const Context& context);

    AtomicFolder(AtomicFolder&& other) noexcept;
    AtomicFolder& operator=(AtomicFolder&&) = delete;
    ~AtomicFolder();

    const std::filesystem::path& path() const { return temporary_; } ///< where files are to be written

    /// Makes the folder durable and visible. At most once.
    Status commit();

  private:
    AtomicFolder() = default;
    Error failure(const char* action, int error_number) const;
    Status exchange();

    std::filesystem::path named_, target_, temporary_;
    const Context* context_ = nullptr;
    bool was_cancelled_ = false;
};

} // namespace hexopt
