#include "tandem/formats/status.h"

#include "tandem/tandem.h"

using tandem::Status;

namespace {

// The statuses that this interface adds to those of the libraries.
struct Entry {
  tandem_status status;
  const char *name, *subject, *sentence;
};

constexpr Entry kEntries[] = {
    {TANDEM_NULL_ARGUMENT, "NullArgument", "place in the list", "a pointer that must be there is null"},
    {TANDEM_BAD_STRUCT_SIZE, "BadStructSize", nullptr,
     "a struct_size that no version had, or bytes of a struct that this version does not know"},
    {TANDEM_INTERNAL_ERROR, "InternalError", nullptr, "a defect of the library"},
    {TANDEM_UNKNOWN_LEVEL, "UnknownLevel", nullptr, "the asset has no such level or part"},
    {TANDEM_FILTER_MISMATCH, "FilterMismatch", nullptr, "a filter is of another number of instances"},
    {TANDEM_CONTACTS_MISSING, "ContactsMissing", nullptr,
     "the contacts that manifolds or contained bodies need were not found of the bodies as they stand"},
    {TANDEM_BAD_MOTION, "BadMotion", "instance", "a motion is a number that names none"},
    {TANDEM_NO_TRIANGLE, "NoTriangle", nullptr, "none of the triangles can be used"},
    {TANDEM_ASSETS_MISSING, "AssetsMissing", nullptr,
     "a handle was given no assets, or others than the query whose contacts it takes"},
    {TANDEM_TOO_MANY_TRIANGLES, "TooManyTriangles", nullptr, "there are 2^32 - 1 triangles or more"},
};

const Entry* entry_of(tandem_status status) {
  for (const Entry& entry : kEntries) {
    if (entry.status == status) return &entry;
  }
  return nullptr;
}

}  // namespace

const char* tandem_status_name(tandem_status status) {
  const Entry* entry = entry_of(status);
  return entry != nullptr ? entry->name : tandem::name(static_cast<Status>(status));
}

const char* tandem_status_explain(tandem_status status) {
  const Entry* entry = entry_of(status);
  return entry != nullptr ? entry->sentence : tandem::explain(static_cast<Status>(status));
}

const char* tandem_status_subject(tandem_status status) {
  // In this interface these two come with the asset that lacks something.
  if (status == TANDEM_NO_TOPOLOGY || status == TANDEM_NO_FINEST_LEVEL) return "asset";
  const Entry* entry = entry_of(status);
  return entry != nullptr ? entry->subject : tandem::subject(static_cast<Status>(status));
}

uint32_t tandem_version(void) {
  return 10000 * TANDEM_VERSION_MAJOR + 100 * TANDEM_VERSION_MINOR + TANDEM_VERSION_PATCH;
}
