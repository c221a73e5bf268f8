"""The files that describe this vehicle to a ground station (https://mavlink.io/en/services/component_information.html).

One module per type, each with a `content()` that follows the published JSON schema of its type (mavlink/mavlink
`component_metadata/`; for events mavlink/libevents `validation/`). The words in them are ours. As with PX4, the files
are the same for all vehicles of a build; they are made when somebody first asks, and FTP serves them.
"""
