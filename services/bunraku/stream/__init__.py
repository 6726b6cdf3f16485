"""Stream service: the only fan-out to viewers.

Path of a block from storage to the socket
------------------------------------------
`storage.motion_store` reads a motion once and keeps its blocks as ready Data messages (`StoredMotion.packets`).

A viewer that receives blocks on its own:

1. `app` (a stored motion) or `watched_session` (a live session) gets the `StoredMotion` from the motion store and
   passes it to `ViewerConnection.set_timeline`.
2. `viewer_connection` hands it to `motion_delivery`, where `MotionFeed` keeps it for the viewer.
3. In a scheduler tick `viewer_connection` asks `MotionFeed.next_packet` for the next message. `motion_delivery` gets
   track, index and level from `delivery.block_scheduler`, and returns the stored bytes (first return to
   `viewer_connection`).
4. `viewer_connection` frames the bytes with `websocket.frame` (second return) and writes them to the
   `websocket.connection`, through `counters`, which counts the bytes.

A viewer of a session that has received all blocks within reach joins a synchronised group:

1. as above, up to `motion_delivery`.
2. `viewer_connection` (first return) passes the delivery to `sync_group`.
3. In the group's tick `sync_group` frames the blocks that are newly due once for all members (second return, from
   `websocket.frame`) and writes them with `websocket.multicast` to all connections.
"""
