; Two rooms for rovers only, 10 s to the left (m1) and 20 s to the right (m2), one target in each, and a single rover:
; it has to be set down, picked up again, carried over and set down once more.

(define (problem retrieve)
  (:domain marsupial)

  (:objects
    carrier_type - robot_type
    rover_type - robot_type
    carrier1 - carrier
    rover1 - rover
    p - start
    t1 - target
    t2 - target
    m1 - meeting
    m2 - meeting
  )

  (:init
    ; Where everybody is
    (at carrier1 p)
    (on rover1 carrier1)
    (aboard rover1)
    (= (num_docked carrier1) 1)
    ; What everybody can do
    (role_carrier carrier_type)
    (role_rover rover_type)
    (is_a carrier1 carrier_type)
    (= (capacity carrier1) 1)
    (is_a rover1 rover_type)
    (= (dock_time rover1) 10.000)
    (= (undock_time rover1) 5.000)
    (can_explore rover1 t1)
    (can_explore rover1 t2)
    (can_stand rover1 m1)
    (can_stand rover1 m2)
    ; How long drives take
    (path carrier_type p m1)
    (= (path_cost carrier_type p m1) 10.000)
    (path carrier_type p m2)
    (= (path_cost carrier_type p m2) 20.000)
    (path carrier_type m1 m2)
    (= (path_cost carrier_type m1 m2) 30.000)
    (path carrier_type m2 m1)
    (= (path_cost carrier_type m2 m1) 30.000)
    (path rover_type t1 m1)
    (= (path_cost rover_type t1 m1) 4.000)
    (path rover_type t2 m2)
    (= (path_cost rover_type t2 m2) 4.000)
    (path rover_type m1 t1)
    (= (path_cost rover_type m1 t1) 4.000)
    (path rover_type m2 t2)
    (= (path_cost rover_type m2 t2) 4.000)
    ; Records, read by no action
    (= (reveal t1) 1.0)
    (= (reveal t2) 1.0)
    (= (travel carrier_type p p) 0.000)
    (= (travel carrier_type m1 p) 10.000)
    (= (travel carrier_type m1 m1) 0.000)
    (= (travel carrier_type m2 p) 20.000)
    (= (travel carrier_type m2 m2) 0.000)
    (= (travel rover_type t1 t1) 0.000)
    (= (travel rover_type t2 t2) 0.000)
    (= (travel rover_type m1 m1) 0.000)
    (= (travel rover_type m2 m2) 0.000)
  )

  (:goal (and
    (explored t1)
    (explored t2)
  ))

  (:metric minimize (total-time)))
