"""Control of limbs: kinematics of arms and legs, ownership, hand-over and overlay (pure: no input or output)."""
